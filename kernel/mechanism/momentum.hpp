// Momentum of a robot on a base that nothing holds, on packs.
//
// With r_i from the system's centre of mass, sums over base and links: H = sum I_i + m_i (|r_i|^2 E - r_i r_i^T), and
// h = sum I_i w_i + m_i r_i x v_i with the joints moving and the base at rest. At zero momentum the base turns with
// w = -H^-1 h (Umetani and Yoshida, 1989). All in the base frame; rates are per whatever the joints' rates are.
#pragma once

#include "mechanism/kinematics.hpp"

namespace SPACEARM_NAMESPACE {

// What is rigidly tied to one joint, or to the base.
template <class T> struct mass_of {
    T mass = 0;
    T com[3] = {};      // in the joint's frame
    T inertia[6] = {};  // about it: xx, yy, zz, xy, xz, yz
    bool principal = true;
};

template <class T> struct mass_model {
    std::vector<mass_of<T>> joints;  // one a joint; empty where no masses are known
    T total = 0;
    T about[3] = {};   // the base's centre of mass: sums are taken about it, for the frame may be far off
    T second[6] = {};  // the base's inertia about it
};

template <class T> mass_of<T> make_mass(double mass, const double* com, const double* inertia) {
    mass_of<T> out;
    out.mass = static_cast<T>(mass);
    for (int k = 0; k < 3; ++k) out.com[k] = static_cast<T>(com[k]);
    for (int k = 0; k < 6; ++k) out.inertia[k] = static_cast<T>(inertia[k]);
    out.principal = inertia[3] == 0 && inertia[4] == 0 && inertia[5] == 0;
    return out;
}

template <class T> struct spin_and_velocity {
    vec3<T> spin, velocity;  // of a joint's frame and its origin
};

template <class T> struct momentum_at {
    vec3<T> com, velocity;  // of the whole system
    vec3<T> arm;            // h
    symmetric3<T> inertia;  // H
};

template <class T> SPACEARM_INLINE void add_point_mass(symmetric3<T>& H, T mass, const vec3<T>& c) {
    const vec3<T> m{c.x * mass, c.y * mass, c.z * mass};
    const pack<T> xx = m.x * c.x, yy = m.y * c.y, zz = m.z * c.z;
    H.xx += yy + zz;
    H.yy += xx + zz;
    H.zz += xx + yy;
    H.xy = H.xy - m.x * c.y;
    H.xz = H.xz - m.x * c.z;
    H.yz = H.yz - m.y * c.z;
}

// Adds R I R^T, and gives R I R^T spin.
template <class T>
SPACEARM_INLINE vec3<T> add_inertia(symmetric3<T>& H, const mass_of<T>& m, const frame<T>& f, const vec3<T>& spin) {
    const T* I = m.inertia;
    const vec3<T>*c = f.column, &x = c[0], &y = c[1], &z = c[2];
    vec3<T> u[3];  // R I, column by column
    if (m.principal) {
        for (int k = 0; k < 3; ++k) u[k] = {c[k].x * I[k], c[k].y * I[k], c[k].z * I[k]};
    } else {
        const T row[3][3] = {{I[0], I[3], I[4]}, {I[3], I[1], I[5]}, {I[4], I[5], I[2]}};
        for (int k = 0; k < 3; ++k) {
            u[k] = {x.x * row[k][0] + y.x * row[k][1] + z.x * row[k][2],
                    x.y * row[k][0] + y.y * row[k][1] + z.y * row[k][2],
                    x.z * row[k][0] + y.z * row[k][1] + z.z * row[k][2]};
        }
    }
    const symmetric3<T> own{u[0].x * x.x + u[1].x * y.x + u[2].x * z.x, u[0].y * x.y + u[1].y * y.y + u[2].y * z.y,
                            u[0].z * x.z + u[1].z * y.z + u[2].z * z.z, u[0].x * x.y + u[1].x * y.y + u[2].x * z.y,
                            u[0].x * x.z + u[1].x * y.z + u[2].x * z.z, u[0].y * x.z + u[1].y * y.z + u[2].y * z.z};
    H.xx += own.xx;
    H.yy += own.yy;
    H.zz += own.zz;
    H.xy += own.xy;
    H.xz += own.xz;
    H.yz += own.yz;
    return times(own, spin);
}

// frames: all columns of all joints, as forward_kinematics leaves them; dq: one pack a degree of freedom; rates:
// memory, one a joint.
template <class T>
inline momentum_at<T> momentum_of(const tree<T>& robot, const mass_model<T>& masses, const pack<T>* dq,
                                  const frame<T>* frames, spin_and_velocity<T>* rates) {
    const pack<T> zero(T(0));
    const vec3<T> none{zero, zero, zero};
    const T* s = masses.second;
    const vec3<T> about{pack<T>(masses.about[0]), pack<T>(masses.about[1]), pack<T>(masses.about[2])};
    vec3<T> first = none, linear = none, angular = none;
    symmetric3<T> H{pack<T>(s[0]), pack<T>(s[1]), pack<T>(s[2]), pack<T>(s[3]), pack<T>(s[4]), pack<T>(s[5])};
    const int n = static_cast<int>(robot.joints.size());
    for (int j = 0; j < n; ++j) {
        const tree_joint<T>& joint = robot.joints[j];
        const frame<T>& at = frames[j];
        const pack<T> rate = joint.plain ? dq[joint.dof] : dq[joint.dof] * joint.multiplier;
        const vec3<T> own{at.column[2].x * rate, at.column[2].y * rate, at.column[2].z * rate};
        spin_and_velocity<T>& r = rates[j];
        if (joint.parent < 0) r = {none, none};
        else {
            const spin_and_velocity<T>& up = rates[joint.parent];
            r = {up.spin, up.velocity + cross(up.spin, at.origin - frames[joint.parent].origin)};
        }
        if (joint.kind == joint_kind::revolute) r.spin = r.spin + own;
        else r.velocity = r.velocity + own;
        const mass_of<T>& m = masses.joints[j];
        if (m.mass == T(0) && m.inertia[0] == T(0) && m.inertia[1] == T(0) && m.inertia[2] == T(0)) continue;
        const vec3<T> at_com = carry(at, m.com), c = at_com - about, v = r.velocity + cross(r.spin, at_com - at.origin);
        const vec3<T> push{v.x * m.mass, v.y * m.mass, v.z * m.mass};
        first = first + vec3<T>{c.x * m.mass, c.y * m.mass, c.z * m.mass};
        linear = linear + push;
        angular = angular + cross(c, push) + add_inertia(H, m, at, r.spin);
        add_point_mass(H, m.mass, c);
    }
    const T share = T(1) / masses.total;
    const vec3<T> com{first.x * share, first.y * share, first.z * share};
    add_point_mass(H, -masses.total, com);  // from there to the centre of mass of the whole
    return {com + about, {linear.x * share, linear.y * share, linear.z * share}, angular - cross(com, linear), H};
}

}  // namespace SPACEARM_NAMESPACE
