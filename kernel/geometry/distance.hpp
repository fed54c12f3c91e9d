// The shapes of obstacles, and the signed distance of a point and of a segment from each.
//
// All are convex, so their signed distance is convex along a line: the least over a link's axis is found by halving on
// the sign of the slope. In float the last stretch is a 1024th of the link: where an axis grazes or enters a box or a
// cylinder, the distance may come out too large by half of that. Inside a shape the distance is how deep the point
// lies, negative.
#pragma once

#include <array>
#include <limits>
#include <vector>

#include "geometry/vectors.hpp"

namespace SPACEARM_NAMESPACE {

template <class T> struct sphere {
    T center[3];
    T radius;
};

template <class T> struct capsule_obstacle {  // a capsule
    T a[3], ab[3];
    T inverse_squared_length;  // 0 if a == b
    T radius;
};
template <class T> struct box_obstacle {
    T center[3];
    T axis[3][3];  // its own x, y and z in the world
    T half[3];
    T rounding = 0;  // the obstacle is all within this of the box
};
template <class T> struct cylinder_obstacle {  // a cylinder with flat ends
    T center[3];
    T axis[3];
    T half_length, radius;
    T rounding = 0;
};
template <class T> struct polytope_obstacle {  // the hull of its vertices, which may be flat
    T center[3];                               // of its bounding box, along the axes of the world
    T half[3];
    T reach;  // of the bounding sphere about the same centre
    T rounding = 0;
    std::vector<std::array<T, 3>> vertices;  // from the centre
};
template <class T> struct half_space_obstacle {  // a half-space: solid where normal . x <= offset
    T normal[3];
    T offset;
};

template <class T> SPACEARM_INLINE pack<T> with_sign_of(const pack<T>& magnitude, const pack<T>& sign) {
    return select(sign < T(0), -magnitude, magnitude);
}

// What the distances below leave out: a subtraction in each of them costs 3 % of a search.
template <class T, class Shape> SPACEARM_INLINE T rounding_of(const Shape& o) {
    if constexpr (std::is_same_v<Shape, box_obstacle<T>> || std::is_same_v<Shape, cylinder_obstacle<T>>)
        return o.rounding;
    else return T(0);
}

// ---- signed distance of a point [m], of a box and a cylinder without their rounding
// ---------------------------------------------------------------------------------
template <class T> SPACEARM_INLINE pack<T> distance_to(const sphere<T>& o, const vec3<T>& p) {
    const vec3<T> d = p - constant(o.center);
    return sqrt(dot(d, d)) - o.radius;
}
template <class T> SPACEARM_INLINE pack<T> distance_to(const capsule_obstacle<T>& o, const vec3<T>& p) {
    const vec3<T> ap = p - constant(o.a);
    const pack<T> t = clamp(dot(ap, o.ab) * o.inverse_squared_length, pack<T>(T(0)), pack<T>(T(1)));
    const vec3<T> rest{ap.x - t * o.ab[0], ap.y - t * o.ab[1], ap.z - t * o.ab[2]};
    return sqrt(dot(rest, rest)) - o.radius;
}
template <class T> SPACEARM_INLINE pack<T> distance_to(const half_space_obstacle<T>& o, const vec3<T>& p) {
    return dot(p, o.normal) - o.offset;
}

// How far a point stands out along two or three of a shape's own directions, negative inside.
template <class T> SPACEARM_INLINE pack<T> outside(const pack<T>& x, const pack<T>& y, const pack<T>& z) {
    const pack<T> u = above_zero(x), v = above_zero(y), w = above_zero(z);  // they keep a NaN
    return sqrt(u * u + v * v + w * w) + min(max(max(x, y), z), pack<T>(T(0)));
}
template <class T> SPACEARM_INLINE pack<T> outside(const pack<T>& x, const pack<T>& y) {
    const pack<T> u = above_zero(x), v = above_zero(y);
    return sqrt(u * u + v * v) + min(max(x, y), pack<T>(T(0)));
}
template <class T> SPACEARM_INLINE pack<T> distance_to(const box_obstacle<T>& o, const vec3<T>& p) {
    const vec3<T> d = p - constant(o.center);
    return outside(abs(dot(d, o.axis[0])) - o.half[0], abs(dot(d, o.axis[1])) - o.half[1],
                   abs(dot(d, o.axis[2])) - o.half[2]);
}
template <class T> SPACEARM_INLINE pack<T> distance_to(const cylinder_obstacle<T>& o, const vec3<T>& p) {
    const vec3<T> d = p - constant(o.center);
    const pack<T> along = dot(d, o.axis);
    const vec3<T> across{d.x - along * o.axis[0], d.y - along * o.axis[1], d.z - along * o.axis[2]};
    return outside(sqrt(dot(across, across)) - o.radius, abs(along) - o.half_length);
}
// Of a polytope only a lower bound, from its bounding box and its bounding sphere; signed_distance has the distance.
template <class T> SPACEARM_INLINE pack<T> distance_to(const polytope_obstacle<T>& o, const vec3<T>& p) {
    const vec3<T> d = p - constant(o.center);
    const pack<T> from_box = outside(abs(d.x) - o.half[0], abs(d.y) - o.half[1], abs(d.z) - o.half[2]);
    return max(sqrt(dot(d, d)) - o.reach, from_box) - o.rounding;
}

// ---- the slope of that distance in a direction, up to a positive factor ---------------------------------------------
// Of a box: by how much the point is beyond its faces, and the slopes of these.
template <class T> SPACEARM_INLINE pack<T> slope_of(const pack<T> (&beyond)[3], const pack<T> (&slope)[3]) {
    const pack<T> zero(T(0)), most = max(max(beyond[0], beyond[1]), beyond[2]);
    const pack<T> out =
        max(beyond[0], zero) * slope[0] + max(beyond[1], zero) * slope[1] + max(beyond[2], zero) * slope[2];
    const pack<T> in = select(most <= beyond[0], slope[0], select(most <= beyond[1], slope[1], slope[2]));
    return select(zero < most, out, in);
}
template <class T>
SPACEARM_INLINE pack<T> slope_at(const box_obstacle<T>& o, const vec3<T>& p, const vec3<T>& direction) {
    const vec3<T> d = p - constant(o.center);
    pack<T> beyond[3], slope[3];
    for (int k = 0; k < 3; ++k) {
        const pack<T> x = dot(d, o.axis[k]);
        beyond[k] = abs(x) - o.half[k];
        slope[k] = with_sign_of(dot(direction, o.axis[k]), x);
    }
    return slope_of(beyond, slope);
}
template <class T>
SPACEARM_INLINE pack<T> slope_at(const cylinder_obstacle<T>& o, const vec3<T>& p, const vec3<T>& direction) {
    const vec3<T> d = p - constant(o.center);
    const pack<T> along = dot(d, o.axis), along_slope = dot(direction, o.axis);
    const vec3<T> across{d.x - along * o.axis[0], d.y - along * o.axis[1], d.z - along * o.axis[2]};
    const pack<T> zero(T(0)), tiny(std::numeric_limits<T>::min()), from_axis = sqrt(dot(across, across));
    const pack<T> radial = from_axis - o.radius, axial = abs(along) - o.half_length;
    const pack<T> radial_slope = dot(across, direction) / max(from_axis, tiny),
                  axial_slope = with_sign_of(along_slope, along);
    const pack<T> out = max(radial, zero) * radial_slope + max(axial, zero) * axial_slope;
    return select(zero < max(radial, axial), out, select(axial <= radial, radial_slope, axial_slope));
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

// ---- least signed distance over a segment from a to a + ab ----------------------------------------------------------
template <class T>
SPACEARM_INLINE pack<T> axis_distance(const sphere<T>& o, const vec3<T>& a, const vec3<T>& ab,
                                      T inverse_squared_length) {
    return sqrt(squared_distance_to_axis(constant(o.center) - a, ab, pack<T>(inverse_squared_length))) - o.radius;
}
template <class T>
SPACEARM_INLINE pack<T> axis_distance(const half_space_obstacle<T>& o, const vec3<T>& a, const vec3<T>& ab, T) {
    return distance_to(o, a) + min(pack<T>(T(0)), dot(ab, o.normal));  // a NaN stays one
}
// Two segments from p to p + u and from q to q + v: where they are nearest inside both, the lines are (Ericson,
// Real-Time Collision Detection, 2005, 5.1.9); else at an end of one. Near parallel the lines' nearest points are not
// to be trusted, but then the ends are as near.
template <class T>
SPACEARM_INLINE pack<T> squared_distance_of_axes(const vec3<T>& p, const vec3<T>& u, T inverse_u2, const vec3<T>& q,
                                                 const vec3<T>& v, T inverse_v2) {
    const pack<T> zero(T(0)), one(T(1)), to_u(inverse_u2), to_v(inverse_v2);
    const vec3<T> r = p - q;
    const pack<T> uv = dot(u, v), ur = dot(u, r), vr = dot(v, r), uu = dot(u, u), vv = dot(v, v);
    const pack<T> across = uu * vv - uv * uv;  // 0 where parallel
    const pack_mask<T> skew = uu * vv * T(8 * std::numeric_limits<T>::epsilon()) < across;
    const pack<T> s = select(skew, clamp((uv * vr - ur * vv) / select(skew, across, one), zero, one), zero);
    const pack<T> t = clamp((uv * s + vr) * inverse_v2, zero, one);
    const vec3<T> d{r.x + u.x * s - v.x * t, r.y + u.y * s - v.y * t, r.z + u.z * s - v.z * t};
    const vec3<T> back = q - p;
    const pack<T> first = min(squared_distance_to_axis(r, v, to_v), squared_distance_to_axis(r + u, v, to_v));
    const pack<T> second = min(squared_distance_to_axis(back, u, to_u), squared_distance_to_axis(back + v, u, to_u));
    return min(min(dot(d, d), first), second);
}
template <class T>
SPACEARM_INLINE pack<T> axis_distance(const capsule_obstacle<T>& o, const vec3<T>& a, const vec3<T>& ab,
                                      T inverse_squared_length) {
    return sqrt(squared_distance_of_axes(a, ab, inverse_squared_length, constant(o.a), constant(o.ab),
                                         o.inverse_squared_length))
           - o.radius;
}
template <class T, class Shape>
SPACEARM_INLINE pack<T> axis_distance(const Shape& o, const vec3<T>& a, const vec3<T>& ab, T inverse_squared_length) {
    if (inverse_squared_length == T(0)) return distance_to(o, a);
    // Halve, then once where the line through the slopes at both ends is level: on the little that is left the slope of
    // a box is straight, or nearly, unless it has a corner there.
    constexpr int halvings = sizeof(T) == 4 ? 10 : 26;
    const pack<T> zero(T(0)), half(T(0.5));
    const auto at = [&](const pack<T>& t) { return vec3<T>{a.x + ab.x * t, a.y + ab.y * t, a.z + ab.z * t}; };
    pack<T> low(zero), high(T(1));
    for (int i = 0; i < halvings; ++i) {
        const pack<T> t = (low + high) * half;
        const pack_mask<T> falls = slope_at(o, at(t), ab) < T(0);
        low = select(falls, t, low);
        high = select(falls, high, t);
    }
    const pack<T> first = slope_at(o, at(low), ab), last = slope_at(o, at(high), ab), rise = last - first;
    const pack<T> level =
        low + (high - low) * clamp(-first / select(zero < rise, rise, pack<T>(T(1))), zero, pack<T>(T(1)));
    return min(min(distance_to(o, at(low)), distance_to(o, at(high))), distance_to(o, at(level)));
}

}  // namespace SPACEARM_NAMESPACE
