// Kinematics of a joint tree on packs: the frame of every moving joint, base at the origin.
//
// A joint's frame is its parent's, times a fixed transform that turns the joint's axis onto z, times the joint's own
// rotation about z or shift along z. Fixed joints are folded into these transforms before they come here.
#pragma once

#include <vector>

#include "geometry/vectors.hpp"

namespace SPACEARM_NAMESPACE {

enum class joint_kind : std::uint8_t { revolute, prismatic };

template <class T> struct tree_joint {
    int parent;  // index of the parent joint, -1 for the base
    joint_kind kind;
    int dof;               // which entry of q drives it; mimic joints share one
    T multiplier, offset;  // value = multiplier * q[dof] + offset
    bool plain;            // multiplier 1 and offset 0
    T rotation[9];         // row-major, fixed, parent joint's frame <- this joint's at q = 0
    T translation[3];
    // Robots are built at right angles: when the fixed rotation only permutes and flips axes, its 27 multiplications
    // are left out. permuted[k] is the parent's column that becomes column k, sign[k] its sign.
    bool right_angled;
    int permuted[3];
    T sign[3];
    unsigned needed = 7;  // which of its columns anything uses (a bit each); the others are not computed
};

template <class T> struct tree {
    std::vector<tree_joint<T>> joints;  // parents before children
    int dofs = 0;
};

template <class T>
tree_joint<T> make_joint(int parent, joint_kind kind, int dof, double multiplier, double offset, const double* rotation,
                         const double* translation) {
    tree_joint<T> j{};
    j.parent = parent;
    j.kind = kind;
    j.dof = dof;
    j.multiplier = static_cast<T>(multiplier);
    j.offset = static_cast<T>(offset);
    j.plain = multiplier == 1.0 && offset == 0.0;
    j.right_angled = true;
    for (int k = 0; k < 3; ++k) {
        int found = -1;
        for (int row = 0; row < 3; ++row) {
            const double r = rotation[3 * row + k];
            if (r == 1.0 || r == -1.0) found = row;
            else if (r != 0.0) j.right_angled = false;
        }
        if (found < 0) j.right_angled = false;
        else {
            j.permuted[k] = found;
            j.sign[k] = static_cast<T>(rotation[3 * found + k]);
        }
    }
    for (int i = 0; i < 9; ++i) j.rotation[i] = static_cast<T>(rotation[i]);
    for (int i = 0; i < 3; ++i) j.translation[i] = static_cast<T>(translation[i]);
    return j;
}

// The three axes that a joint turns: its parent's, after the fixed rotation. With a right-angled one they are the
// parent's own columns, up to the sign that `sign` gives.
template <class T> struct turned_axes {
    const vec3<T>* axis[3];
    T sign[3];
    vec3<T> storage[3];
};

template <class T>
SPACEARM_INLINE void fixed_rotation(const tree_joint<T>& joint, const frame<T>& parent, turned_axes<T>& out) {
    for (int k = 0; k < 3; ++k) {
        if (joint.right_angled) {
            out.axis[k] = &parent.column[joint.permuted[k]];
            out.sign[k] = joint.sign[k];
            continue;
        }
        const pack<T> r0(joint.rotation[k]), r1(joint.rotation[3 + k]), r2(joint.rotation[6 + k]);
        out.storage[k].x = parent.column[0].x * r0 + parent.column[1].x * r1 + parent.column[2].x * r2;
        out.storage[k].y = parent.column[0].y * r0 + parent.column[1].y * r1 + parent.column[2].y * r2;
        out.storage[k].z = parent.column[0].z * r0 + parent.column[1].z * r1 + parent.column[2].z * r2;
        out.axis[k] = &out.storage[k];
        out.sign[k] = T(1);
    }
}

// q: one pack a degree of freedom; frames: one a joint. Columns that no point and no later joint needs are left alone.
template <class T> inline void forward_kinematics(const tree<T>& robot, const pack<T>* q, frame<T>* frames) {
    const int n = static_cast<int>(robot.joints.size());
    const frame<T> base = base_frame<T>();
    for (int j = 0; j < n; ++j) {
        const tree_joint<T>& joint = robot.joints[j];
        const frame<T>& parent = joint.parent < 0 ? base : frames[joint.parent];
        frame<T>& out = frames[j];
        const pack<T> value = joint.plain ? q[joint.dof] : q[joint.dof] * joint.multiplier + joint.offset;
        out.origin = carry(parent, joint.translation);
        turned_axes<T> a;
        fixed_rotation(joint, parent, a);
        const unsigned needed = joint.needed;
        if (needed & 4) out.column[2] = a.sign[2] == T(1) ? *a.axis[2] : scaled(*a.axis[2], pack<T>(a.sign[2]));
        if (joint.kind == joint_kind::revolute) {
            pack<T> s, c;
            sincos(value, s, c);
            if (needed & 1) out.column[0] = turned(*a.axis[0], c * a.sign[0], *a.axis[1], s * a.sign[1]);
            if (needed & 2) out.column[1] = turned(*a.axis[0], s * -a.sign[0], *a.axis[1], c * a.sign[1]);
        } else {
            if (needed & 1) out.column[0] = scaled(*a.axis[0], pack<T>(a.sign[0]));
            if (needed & 2) out.column[1] = scaled(*a.axis[1], pack<T>(a.sign[1]));
            const pack<T> shift = value * a.sign[2];
            out.origin.x += a.axis[2]->x * shift;
            out.origin.y += a.axis[2]->y * shift;
            out.origin.z += a.axis[2]->z * shift;
        }
    }
}

// Marks the columns that are needed: by the points (a mask a joint, of their non-zero coordinates), and by the joints
// that stand on this one.
template <class T> inline void mark_needed(tree<T>& robot, std::vector<unsigned> used) {
    for (int j = static_cast<int>(robot.joints.size()) - 1; j >= 0; --j) {
        tree_joint<T>& joint = robot.joints[j];
        joint.needed = used[j];
        if (joint.parent < 0) continue;
        unsigned& up = used[joint.parent];
        for (int k = 0; k < 3; ++k) up |= joint.translation[k] != T(0) ? 1u << k : 0u;
        const bool turns = joint.kind == joint_kind::revolute && (used[j] & 3);
        const unsigned axes =
            (turns ? 3u : used[j] & 3) | (used[j] & 4) | (joint.kind == joint_kind::prismatic ? 4u : 0u);
        for (int k = 0; k < 3; ++k) {
            if (axes >> k & 1) up |= joint.right_angled ? 1u << joint.permuted[k] : 7u;
        }
    }
}

}  // namespace SPACEARM_NAMESPACE
