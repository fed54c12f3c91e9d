// Clearances: one function a pair of shapes.
#pragma once

#include "tree.hpp"

namespace SPACEARM_NAMESPACE {

template <class T> struct sphere {
    T center[3];
    T radius;
};

// A capsule's axis runs between two of the model's points, both on the same rigid body, so its length is constant.
template <class T> struct capsule {
    int a, b;  // point indices
    T radius;
    T inverse_squared_length;  // 0 for a sphere (a == b)
};

template <class T> SPACEARM_INLINE vec3<T> constant(const T* p) {
    return {pack<T>(p[0]), pack<T>(p[1]), pack<T>(p[2])};
}

// Squared distance from a sphere's centre to a capsule's axis: with the projection clamped to the segment this is the
// smaller of the joint-centre distances of eq. (1) and, when eq. (2) puts the projection on the link, that of eq. (3).
// ac runs from the axis' start a to the centre, ab from a to its end b.
template <class T>
SPACEARM_INLINE pack<T> squared_distance_to_axis(const vec3<T>& ac, const vec3<T>& ab,
                                                 const pack<T>& inverse_squared_length) {
    const pack<T> t = clamp(dot(ac, ab) * inverse_squared_length, pack<T>(T(0)), pack<T>(T(1)));
    const vec3<T> rest{ac.x - ab.x * t, ac.y - ab.y * t, ac.z - ab.z * t};
    return dot(rest, rest);
}

// Clearance [m] of capsule and sphere, negative when they penetrate.
template <class T>
SPACEARM_INLINE pack<T> capsule_sphere_clearance(const vec3<T>& a, const vec3<T>& b, const capsule<T>& link,
                                                 const sphere<T>& ball) {
    const vec3<T> c{pack<T>(ball.center[0]), pack<T>(ball.center[1]), pack<T>(ball.center[2])};
    const pack<T> d2 = squared_distance_to_axis(c - a, b - a, pack<T>(link.inverse_squared_length));
    return sqrt(d2) - (link.radius + ball.radius);
}

}  // namespace SPACEARM_NAMESPACE
