// Vectors, frames and rotations: on packs, a configuration or an instant a lane, and of single numbers.
#pragma once

#include "lanes/trig.hpp"

namespace SPACEARM_NAMESPACE {

// ---- on packs
template <class T> struct vec3 {
    pack<T> x, y, z;
};
template <class T> SPACEARM_INLINE vec3<T> operator+(const vec3<T>& a, const vec3<T>& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class T> SPACEARM_INLINE vec3<T> operator-(const vec3<T>& a, const vec3<T>& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class T> SPACEARM_INLINE pack<T> dot(const vec3<T>& a, const vec3<T>& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

// The columns of the rotation and the origin, in the base frame.
template <class T> struct frame {
    vec3<T> column[3];
    vec3<T> origin;
};

template <class T> SPACEARM_INLINE vec3<T> constant(const T* p) {
    return {pack<T>(p[0]), pack<T>(p[1]), pack<T>(p[2])};
}
template <class T> SPACEARM_INLINE pack<T> dot(const vec3<T>& a, const T* b) {
    return a.x * b[0] + a.y * b[1] + a.z * b[2];
}
template <class T> SPACEARM_INLINE vec3<T> cross(const vec3<T>& a, const vec3<T>& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// A fixed local point, carried by a frame. Zero coordinates are common (points on an axis) and cost nothing.
template <class T> SPACEARM_INLINE vec3<T> carry(const frame<T>& f, const T* local) {
    vec3<T> p = f.origin;
    for (int k = 0; k < 3; ++k) {
        if (local[k] == T(0)) continue;
        p.x += f.column[k].x * local[k];
        p.y += f.column[k].y * local[k];
        p.z += f.column[k].z * local[k];
    }
    return p;
}

template <class T> SPACEARM_INLINE vec3<T> scaled(const vec3<T>& a, const pack<T>& s) {
    return {a.x * s, a.y * s, a.z * s};
}
template <class T>
SPACEARM_INLINE vec3<T> turned(const vec3<T>& a, const pack<T>& c, const vec3<T>& b, const pack<T>& s) {
    return {a.x * c + b.x * s, a.y * c + b.y * s, a.z * c + b.z * s};
}

template <class T> SPACEARM_INLINE vec3<T> rotate(const frame<T>& f, const T* local) {
    vec3<T> p{pack<T>(T(0)), pack<T>(T(0)), pack<T>(T(0))};
    for (int k = 0; k < 3; ++k) {
        if (local[k] == T(0)) continue;
        p.x += f.column[k].x * local[k];
        p.y += f.column[k].y * local[k];
        p.z += f.column[k].z * local[k];
    }
    return p;
}

template <class T> SPACEARM_INLINE frame<T> base_frame() {
    const pack<T> zero(T(0)), one(T(1));
    return {{{one, zero, zero}, {zero, one, zero}, {zero, zero, one}}, {zero, zero, zero}};
}

// A frame given in the base frame, where the base is: the columns in `needed`, and the origin.
template <class T>
SPACEARM_INLINE void put(const frame<T>& base, const frame<T>& local, unsigned needed, frame<T>& out) {
    const auto turn = [&](const vec3<T>& v) {
        return vec3<T>{base.column[0].x * v.x + base.column[1].x * v.y + base.column[2].x * v.z,
                       base.column[0].y * v.x + base.column[1].y * v.y + base.column[2].y * v.z,
                       base.column[0].z * v.x + base.column[1].z * v.y + base.column[2].z * v.z};
    };
    for (int k = 0; k < 3; ++k) {
        if (needed >> k & 1) out.column[k] = turn(local.column[k]);
    }
    out.origin = turn(local.origin) + base.origin;
}

template <class T> struct symmetric3 {
    pack<T> xx, yy, zz, xy, xz, yz;
};
template <class T> SPACEARM_INLINE vec3<T> times(const symmetric3<T>& m, const vec3<T>& v) {
    return {m.xx * v.x + m.xy * v.y + m.xz * v.z, m.xy * v.x + m.yy * v.y + m.yz * v.z,
            m.xz * v.x + m.yz * v.y + m.zz * v.z};
}
// Solves m x = v, by the adjugate: H is positive definite and far from singular.
template <class T> SPACEARM_INLINE vec3<T> solved(const symmetric3<T>& m, const vec3<T>& v) {
    const symmetric3<T> a{m.yy * m.zz - m.yz * m.yz, m.xx * m.zz - m.xz * m.xz, m.xx * m.yy - m.xy * m.xy,
                          m.xz * m.yz - m.xy * m.zz, m.xy * m.yz - m.xz * m.yy, m.xy * m.xz - m.xx * m.yz};
    const pack<T> inverse = pack<T>(T(1)) / (m.xx * a.xx + m.xy * a.xy + m.xz * a.xz);
    const vec3<T> x = times(a, v);
    return {x.x * inverse, x.y * inverse, x.z * inverse};
}

// ---- of single numbers, in double
struct quaternion {
    double w = 1, x = 0, y = 0, z = 0;
};
inline quaternion operator*(const quaternion& a, const quaternion& b) {
    return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
            a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}
inline quaternion conjugate(const quaternion& q) { return {q.w, -q.x, -q.y, -q.z}; }

struct rotation3 {
    double c[3][3];  // columns
};
inline void rotated(const rotation3& m, const double* v, double* out) {
    for (int i = 0; i < 3; ++i) out[i] = m.c[0][i] * v[0] + m.c[1][i] * v[1] + m.c[2][i] * v[2];
}
// The rotation vector of a quaternion.
inline void rotation_vector(const quaternion& given, double* out) {
    const double sign = given.w < 0 ? -1 : 1, s = std::sqrt(given.x * given.x + given.y * given.y + given.z * given.z);
    const double factor = s > 1e-12 ? sign * 2 * angle_of(s, sign * given.w) / s : 2 * sign;
    out[0] = given.x * factor;
    out[1] = given.y * factor;
    out[2] = given.z * factor;
}
inline quaternion quaternion_of(const rotation3& m) {
    const auto r = [&](int row, int column) { return m.c[column][row]; };
    quaternion q;
    const double trace = r(0, 0) + r(1, 1) + r(2, 2);
    if (trace > 0) q = {1 + trace, r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1)};
    else if (r(0, 0) >= r(1, 1) && r(0, 0) >= r(2, 2))
        q = {r(2, 1) - r(1, 2), 1 + r(0, 0) - r(1, 1) - r(2, 2), r(0, 1) + r(1, 0), r(0, 2) + r(2, 0)};
    else if (r(1, 1) >= r(2, 2))
        q = {r(0, 2) - r(2, 0), r(0, 1) + r(1, 0), 1 + r(1, 1) - r(0, 0) - r(2, 2), r(1, 2) + r(2, 1)};
    else q = {r(1, 0) - r(0, 1), r(0, 2) + r(2, 0), r(1, 2) + r(2, 1), 1 + r(2, 2) - r(0, 0) - r(1, 1)};
    const double length = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
    return {q.w / length, q.x / length, q.y / length, q.z / length};
}

// The last lane of a pack, and of a frame.
template <class T> double last_lane(const pack<T>& p) {
    T lane[lanes_of<T>];
    p.store(lane);
    return lane[lanes_of<T> - 1];
}
template <class T> void last_lanes(const frame<T>& f, rotation3& axes, double* origin) {
    for (int k = 0; k < 3; ++k) {
        axes.c[k][0] = last_lane(f.column[k].x);
        axes.c[k][1] = last_lane(f.column[k].y);
        axes.c[k][2] = last_lane(f.column[k].z);
    }
    origin[0] = last_lane(f.origin.x);
    origin[1] = last_lane(f.origin.y);
    origin[2] = last_lane(f.origin.z);
}

}  // namespace SPACEARM_NAMESPACE
