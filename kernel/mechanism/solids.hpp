// Bodies of links that are boxes, cylinders or polytopes, and how far they are from everything else.
//
// Bounds come first: bounding spheres, then the bounding box of one body against the bounding sphere, and the bounding
// capsule, of the other. Only where a pair is near in some lane its distance is computed. The axis of a capsule is
// measured in the frame of the box or the cylinder, as it is by an obstacle of that shape: inside, the distance is how
// deep the axis' deepest point lies. All other pairs are left to signed_distance.
#pragma once

#include <memory>

#include "geometry/obstacles.hpp"

namespace SPACEARM_NAMESPACE {

template <class T> using vertex_list = std::vector<std::array<T, 3>>;

// A capsule around a solid, about its origin and along one of its axes.
template <class T> struct bounding_rod {
    int along;
    T half_length, radius;
};
template <class T> struct link_solid {
    convex_shape<T> shape;
    std::shared_ptr<const vertex_list<T>> vertices;  // of a polytope: those of the shape
    T axis[3][3], origin[3];                         // its own, in the joint's frame
    T half[3];                                       // of a box around it, about its origin; without its rounding
    T reach;                                         // of a sphere about its origin
    bounding_rod<T> rod;
};
// The axis of a capsule or the centre of a sphere.
template <class T> struct placed_axis {
    vec3<T> middle, a, ab;     // of a sphere only the middle
    T inverse_squared_length;  // 0 for a sphere
    T radius, reach;           // of the capsule, and of its bounding sphere
};
// A solid in place, or an obstacle.
template <class T> struct placed_solid {
    placed_shape<T> at;
    const T* half;
    T reach;
    bounding_rod<T> rod;
};

template <class T> SPACEARM_INLINE placed_shape<T> placed(const link_solid<T>& s, const frame<T>& f) {
    return {&s.shape, {rotate(f, s.axis[0]), rotate(f, s.axis[1]), rotate(f, s.axis[2])}, carry(f, s.origin)};
}

// ---- a box and a cylinder in their own frame ------------------------------------------------------------------------
template <class T> struct own_box {
    const T* half;
    T rounding;
};
template <class T> struct own_cylinder {
    T radius, half_length, rounding;
};
template <class T> SPACEARM_INLINE pack<T> distance_to(const own_box<T>& o, const vec3<T>& p) {
    return outside(abs(p.x) - o.half[0], abs(p.y) - o.half[1], abs(p.z) - o.half[2]) - o.rounding;
}
template <class T> SPACEARM_INLINE pack<T> distance_to(const own_cylinder<T>& o, const vec3<T>& p) {
    return outside(sqrt(p.x * p.x + p.y * p.y) - o.radius, abs(p.z) - o.half_length) - o.rounding;
}
template <class T> SPACEARM_INLINE pack<T> slope_at(const own_box<T>& o, const vec3<T>& p, const vec3<T>& direction) {
    const pack<T> beyond[3] = {abs(p.x) - o.half[0], abs(p.y) - o.half[1], abs(p.z) - o.half[2]};
    const pack<T> slope[3] = {with_sign_of(direction.x, p.x), with_sign_of(direction.y, p.y),
                              with_sign_of(direction.z, p.z)};
    return slope_of(beyond, slope);
}
template <class T>
SPACEARM_INLINE pack<T> slope_at(const own_cylinder<T>& o, const vec3<T>& p, const vec3<T>& direction) {
    const pack<T> zero(T(0)), tiny(std::numeric_limits<T>::min()), from_axis = sqrt(p.x * p.x + p.y * p.y);
    const pack<T> radial = from_axis - o.radius, axial = abs(p.z) - o.half_length;
    const pack<T> radial_slope = (p.x * direction.x + p.y * direction.y) / max(from_axis, tiny),
                  axial_slope = with_sign_of(direction.z, p.z);
    const pack<T> out = max(radial, zero) * radial_slope + max(axial, zero) * axial_slope;
    return select(zero < max(radial, axial), out, select(axial <= radial, radial_slope, axial_slope));
}

// ---- clearances [m]; lanes at `enough` or beyond may return any lower bound of at least `enough` --------------------
// Of a solid and a capsule.
template <class T>
SPACEARM_NOINLINE pack<T> axis_clearance(const placed_solid<T>& s, const placed_axis<T>& axis, T enough, bool depth) {
    const auto turned = [&](const vec3<T>& d) {
        return vec3<T>{dot(s.at.axis[0], d), dot(s.at.axis[1], d), dot(s.at.axis[2], d)};
    };
    const convex_shape<T>& shape = *s.at.shape;
    const own_box<T> box{s.half, shape.radius};
    const pack<T> zero(T(0)), far(enough);
    const vec3<T> middle = turned(axis.middle - s.at.origin);
    const pack<T> from_middle = distance_to(box, middle);
    if (all(pack<T>(axis.reach + enough) <= from_middle)) return far;
    const bool is_point = axis.inverse_squared_length == T(0);
    vec3<T> a = middle, ab{zero, zero, zero};
    if (!is_point) {
        a = turned(axis.a - s.at.origin);
        ab = turned(axis.ab);
        const pack<T> nearest_end = min(distance_to(box, a), distance_to(box, a + ab));
        const T quarter = (axis.reach - axis.radius) * T(0.5);  // as for obstacles: envelope.hpp
        if (all(pack<T>(axis.radius + enough + quarter) <= (from_middle + nearest_end) * T(0.5))) return far;
    }
    if (shape.kind == core_kind::box) {
        return (is_point ? from_middle : axis_distance(box, a, ab, axis.inverse_squared_length)) - axis.radius;
    }
    if (shape.kind == core_kind::cylinder) {
        const own_cylinder<T> cylinder{shape.half[0], shape.half[2], shape.radius};
        return axis_distance(cylinder, a, ab, axis.inverse_squared_length) - axis.radius;
    }
    const T length = is_point ? T(0) : T(1) / std::sqrt(axis.inverse_squared_length);
    const convex_shape<T> segment{core_kind::segment, {T(0), T(0), length / 2}, axis.radius, 0, nullptr};
    const vec3<T> none{zero, zero, zero};
    const placed_shape<T> core{
        &segment, {none, none, is_point ? none : scaled(axis.ab, pack<T>(T(1) / length))}, axis.middle};
    return signed_distance(core, s.at, enough, depth);
}

// Whether a bounding sphere is at least `enough` away from the box around a solid, in all lanes.
template <class T> SPACEARM_INLINE bool box_is_far(const placed_solid<T>& s, const vec3<T>& center, T reach, T enough) {
    const vec3<T> d = center - s.at.origin;
    const vec3<T> seen{dot(s.at.axis[0], d), dot(s.at.axis[1], d), dot(s.at.axis[2], d)};
    return all(pack<T>(reach + enough) <= distance_to(own_box<T>{s.half, s.at.shape->radius}, seen));
}

// The same of a bounding capsule; a short one has nothing to add to the sphere.
template <class T> SPACEARM_INLINE bool box_is_far(const placed_solid<T>& s, const placed_solid<T>& t, T enough) {
    if (t.rod.half_length < t.rod.radius) return false;
    const auto turned = [&](const vec3<T>& d) {
        return vec3<T>{dot(s.at.axis[0], d), dot(s.at.axis[1], d), dot(s.at.axis[2], d)};
    };
    const own_box<T> box{s.half, s.at.shape->radius};
    const vec3<T> middle = turned(t.at.origin - s.at.origin);
    const vec3<T> half = scaled(turned(t.at.axis[t.rod.along]), pack<T>(t.rod.half_length));
    const pack<T> nearest_end = min(distance_to(box, middle - half), distance_to(box, middle + half));
    const T quarter = t.rod.half_length * T(0.5);  // as for obstacles: envelope.hpp
    return all(pack<T>(t.rod.radius + enough + quarter) <= (distance_to(box, middle) + nearest_end) * T(0.5));
}

// Of two solids.
template <class T>
SPACEARM_NOINLINE pack<T> solid_clearance(const placed_solid<T>& s, const placed_solid<T>& t, T enough, bool depth) {
    if (box_is_far(s, t.at.origin, t.reach, enough) || box_is_far(t, s.at.origin, s.reach, enough))
        return pack<T>(enough);
    if (box_is_far(s, t, enough) || box_is_far(t, s, enough)) return pack<T>(enough);
    return signed_distance(s.at, t.at, enough, depth);
}

// Of a solid and an obstacle.
template <class T> SPACEARM_INLINE placed_axis<T> axis_of(const sphere<T>& o) {
    const vec3<T> at = constant(o.center);
    return {at, at, at, T(0), o.radius, o.radius};
}
template <class T> SPACEARM_INLINE placed_axis<T> axis_of(const capsule_obstacle<T>& o) {
    const vec3<T> a = constant(o.a), ab = constant(o.ab);
    const T half = o.inverse_squared_length == T(0) ? T(0) : T(0.5) / std::sqrt(o.inverse_squared_length);
    return {a + scaled(ab, pack<T>(T(0.5))), a, ab, o.inverse_squared_length, o.radius, o.radius + half};
}
template <class T> T length_of(T x, T y, T z) { return std::sqrt(x * x + y * y + z * z); }
// The capsule around a box of half edges, or around a cylinder. A little larger, for the rounding of numbers.
template <class T> bounding_rod<T> rod_around(core_kind kind, const T* half, T rounding) {
    const int along = kind == core_kind::cylinder                ? 2
                      : half[0] >= half[1] && half[0] >= half[2] ? 0
                      : half[1] >= half[2]                       ? 1
                                                                 : 2;
    const T p = half[(along + 1) % 3], q = half[(along + 2) % 3];
    const T across = kind == core_kind::cylinder ? p : std::sqrt(p * p + q * q);
    return {along, half[along], (across + rounding) * (1 + 8 * std::numeric_limits<T>::epsilon())};
}
// Calls use(solid) with an obstacle as a solid in place.
template <class T, class Shape, class Use> SPACEARM_INLINE auto with_solid(const Shape& o, Use&& use) {
    const standing_shape<T> standing_o = standing(o);
    T half[3], reach = standing_o.shape.radius;
    if constexpr (std::is_same_v<Shape, polytope_obstacle<T>>) {
        std::copy_n(o.half, 3, half);
        reach += o.reach;
    } else {
        std::copy_n(standing_o.shape.half, 3, half);
        const T round = std::is_same_v<Shape, cylinder_obstacle<T>> ? T(0) : half[1];
        reach += length_of(half[0], round, half[2]);
    }
    reach *= 1 + 8 * std::numeric_limits<T>::epsilon();
    const bounding_rod<T> rod = rod_around(standing_o.shape.kind, half, standing_o.shape.radius);
    return use(placed_solid<T>{standing_o.placed(), half, reach, rod});
}
template <class T, class Shape>
pack<T> obstacle_clearance(const placed_solid<T>& s, const Shape& o, T enough, bool depth) {
    if constexpr (std::is_same_v<Shape, half_space_obstacle<T>>) {
        return signed_distance(s.at, o, enough);
    } else if constexpr (std::is_same_v<Shape, sphere<T>> || std::is_same_v<Shape, capsule_obstacle<T>>) {
        return axis_clearance(s, axis_of(o), enough, depth);
    } else {
        return with_solid<T>(o, [&](const placed_solid<T>& t) { return solid_clearance(s, t, enough, depth); });
    }
}
// Of a capsule and an obstacle; only polytopes need `enough`.
template <class T, class Shape>
SPACEARM_INLINE pack<T> obstacle_clearance(const placed_axis<T>& axis, const Shape& o, T enough, bool depth) {
    if constexpr (std::is_same_v<Shape, polytope_obstacle<T>>) {
        return with_solid<T>(o, [&](const placed_solid<T>& s) { return axis_clearance(s, axis, enough, depth); });
    } else {
        return axis_distance(o, axis.a, axis.ab, axis.inverse_squared_length) - (axis.radius + rounding_of<T>(o));
    }
}

// ---- building -------------------------------------------------------------------------------------------------------
// In the joint's frame, in double.
struct solid_description {
    core_kind kind = core_kind::box;
    double half[3] = {}, radius = 0;
    std::vector<std::array<double, 3>> vertices;  // of a polytope, in its own frame
    double axis[3][3] = {}, origin[3] = {};
};
template <class T> link_solid<T> make_solid(const solid_description& given) {
    link_solid<T> s{};
    vertex_list<T> vertices;
    double half[3] = {}, reach = 0;
    for (const auto& v : given.vertices) {
        vertices.push_back({static_cast<T>(v[0]), static_cast<T>(v[1]), static_cast<T>(v[2])});
        for (int k = 0; k < 3; ++k) half[k] = std::max(half[k], std::abs(v[k]));
        reach = std::max(reach, length_of(v[0], v[1], v[2]));
    }
    if (given.kind != core_kind::polytope) {
        std::copy_n(given.half, 3, half);
        reach = length_of(half[0], given.kind == core_kind::cylinder ? 0.0 : half[1], half[2]);
    }
    const double wider = 1 + 4 * double(std::numeric_limits<T>::epsilon());  // for the rounding of numbers
    for (int k = 0; k < 3; ++k) {
        s.half[k] = static_cast<T>(given.kind == core_kind::polytope ? half[k] * wider : half[k]);
        s.origin[k] = static_cast<T>(given.origin[k]);
        for (int r = 0; r < 3; ++r) s.axis[k][r] = static_cast<T>(given.axis[k][r]);
    }
    s.reach = static_cast<T>((reach + given.radius) * wider);
    s.rod = rod_around(given.kind, s.half, static_cast<T>(given.radius));
    s.vertices = std::make_shared<const vertex_list<T>>(std::move(vertices));
    s.shape = {given.kind,
               {static_cast<T>(given.half[0]), static_cast<T>(given.half[1]), static_cast<T>(given.half[2])},
               static_cast<T>(given.radius),
               static_cast<int>(s.vertices->size()),
               reinterpret_cast<const T(*)[3]>(s.vertices->data())};
    return s;
}

}  // namespace SPACEARM_NAMESPACE
