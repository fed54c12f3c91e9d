// How far a joint moves what stands on it: the measure by which joints of all kinds and sizes are compared.
#pragma once

#include "mechanism/model.hpp"

namespace SPACEARM_NAMESPACE {

// For each degree of freedom a bound of how far a unit of it moves any point of the bodies [m/rad] or [m/m]. `most`
// (n,): the greatest value it may have, without its sign [rad or m]; a slide carries what stands on it so far out.
template <class T> std::vector<T> levers(const model<T>& m, const std::vector<T>& most) {
    const auto norm = [](const T* v) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); };
    const auto& joints = m.robot.joints;
    std::vector<T> reach(joints.size(), T(0)), out(m.robot.dofs, T(0));  // from the joint's origin
    for (const cluster<T>& c : m.envelope.clusters) {
        if (c.joint >= 0) reach[c.joint] = std::max(reach[c.joint], norm(c.center) + c.radius);
    }
    for (int j = static_cast<int>(joints.size()) - 1; j >= 0; --j) {
        const tree_joint<T>& joint = joints[j];
        const bool shifts = joint.kind == joint_kind::prismatic;
        const T multiplier = std::abs(joint.multiplier);
        const T slid = shifts ? std::abs(joint.offset) + multiplier * most[joint.dof] : T(0);
        if (joint.parent >= 0)
            reach[joint.parent] = std::max(reach[joint.parent], reach[j] + slid + norm(joint.translation));
        out[joint.dof] += multiplier * (shifts ? T(1) : reach[j]);
    }
    return out;
}

}  // namespace SPACEARM_NAMESPACE
