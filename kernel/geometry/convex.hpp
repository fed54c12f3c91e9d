// The signed distance of any two convex shapes, a configuration a lane.
//
// A shape is a core (segment, box, cylinder, polytope) and a radius around it. The signed distance of two cores A and B
// is the greatest value, over all unit directions n, of
//
//     g(n) = least n . x over the points x of A - B.
//
// It is their distance where they are apart, and less the penetration depth where they overlap. So g of any direction
// is a lower bound. Everything here proposes directions, and returns the greatest g of these. A search that stops
// early, or that rounding leads astray, gives a distance that is too small, never one that is too large by more than
// the rounding of g itself: some units in the last place of the coordinates.
#pragma once

#include <limits>

#include "geometry/gjk.hpp"
#include "geometry/penetration.hpp"

namespace SPACEARM_NAMESPACE {

namespace convex_detail {

// What GJK leaves open: cores that overlap. Their depth is searched for one lane at a time, in double.
template <class T>
SPACEARM_NOINLINE void search_depths(const convex_shape<T>& a, const convex_shape<T>& b, const frame<T>& b_in_a,
                                     const pack_mask<T>& open, pack<T>& lower) {
    constexpr int W = lanes_of<T>;
    T is_open[W], bound[W], pose[12][W];
    select(open, pack<T>(T(1)), pack<T>(T(0))).store(is_open);
    lower.store(bound);
    for (int k = 0; k < 4; ++k) {
        const vec3<T>& v = k < 3 ? b_in_a.column[k] : b_in_a.origin;
        v.x.store(pose[3 * k]);
        v.y.store(pose[3 * k + 1]);
        v.z.store(pose[3 * k + 2]);
    }
    for (int i = 0; i < W; ++i) {
        if (is_open[i] == T(0)) continue;
        rotation3 axes;
        double origin[3];
        for (int k = 0; k < 3; ++k) {
            for (int r = 0; r < 3; ++r) axes.c[k][r] = double(pose[3 * k + r][i]);
            origin[k] = double(pose[9 + k][i]);
        }
        const T found = static_cast<T>(-penetration_depth(a, b, axes, origin));
        bound[i] = bound[i] < found ? found : bound[i];
    }
    lower = pack<T>::load(bound);
}

template <core_kind A, core_kind B, class T>
SPACEARM_NOINLINE pack<T> core_distance(const convex_shape<T>& a, const convex_shape<T>& b, const frame<T>& b_in_a,
                                        const pack<T>& nothing, T enough) {
    const gjk_bounds<T> found = gjk<A, B>(a, b, b_in_a, nothing, enough);
    pack<T> lower = found.lower;
    const pack_mask<T> open = (lower < -found.slack) & (lower < pack<T>(enough));
    if (any(open)) search_depths(a, b, b_in_a, open, lower);
    return lower;
}

template <class T>
SPACEARM_INLINE pack<T> segment_distance(const convex_shape<T>& a, const convex_shape<T>& b, const frame<T>& b_in_a) {
    const pack<T> zero(T(0));
    const T p = a.half[2], q = b.half[2];
    const vec3<T> u{zero, zero, pack<T>(2 * p)}, v = scaled(b_in_a.column[2], pack<T>(2 * q));
    const vec3<T> from{zero, zero, pack<T>(-p)}, to = b_in_a.origin - scaled(b_in_a.column[2], pack<T>(q));
    const T u2 = 4 * p * p, v2 = 4 * q * q;
    return sqrt(squared_distance_of_axes(from, u, u2 > T(0) ? 1 / u2 : T(0), to, v, v2 > T(0) ? 1 / v2 : T(0)));
}

// The kinds in the order of core_kind: the first is not after the second.
template <class T>
SPACEARM_INLINE pack<T> ordered_distance(const convex_shape<T>& a, const convex_shape<T>& b, const frame<T>& b_in_a,
                                         const pack<T>& nothing, T enough) {
    using enum core_kind;
    const auto pair = [](core_kind one, core_kind two) { return static_cast<int>(one) * 4 + static_cast<int>(two); };
    switch (pair(a.kind, b.kind)) {
        case pair(segment, segment): return segment_distance(a, b, b_in_a);
        case pair(segment, box): return core_distance<segment, box>(a, b, b_in_a, nothing, enough);
        case pair(segment, cylinder): return core_distance<segment, cylinder>(a, b, b_in_a, nothing, enough);
        case pair(segment, polytope): return core_distance<segment, polytope>(a, b, b_in_a, nothing, enough);
        case pair(box, box): return core_distance<box, box>(a, b, b_in_a, nothing, enough);
        case pair(box, cylinder): return core_distance<box, cylinder>(a, b, b_in_a, nothing, enough);
        case pair(box, polytope): return core_distance<box, polytope>(a, b, b_in_a, nothing, enough);
        case pair(cylinder, cylinder): return core_distance<cylinder, cylinder>(a, b, b_in_a, nothing, enough);
        case pair(cylinder, polytope): return core_distance<cylinder, polytope>(a, b, b_in_a, nothing, enough);
        default: return core_distance<polytope, polytope>(a, b, b_in_a, nothing, enough);
    }
}

// B's axes and origin in A's frame.
template <class T> SPACEARM_INLINE frame<T> in_frame_of(const placed_shape<T>& a, const placed_shape<T>& b) {
    const auto seen = [&](const vec3<T>& v) {
        return vec3<T>{dot(a.axis[0], v), dot(a.axis[1], v), dot(a.axis[2], v)};
    };
    return {{seen(b.axis[0]), seen(b.axis[1]), seen(b.axis[2])}, seen(b.origin - a.origin)};
}

}  // namespace convex_detail

// The signed distance of two shapes [m]: negative where they overlap, by the penetration depth. Lanes at `enough` or
// beyond may return any lower bound of at least `enough`. A lane with a number that is none returns NaN.
template <class T> inline pack<T> signed_distance(const placed_shape<T>& a, const placed_shape<T>& b, T enough) {
    if (b.shape->kind < a.shape->kind) return signed_distance(b, a, enough);
    const frame<T> f = convex_detail::in_frame_of(a, b);
    pack<T> sum = f.origin.x + f.origin.y + f.origin.z;
    for (const vec3<T>& c : f.column) sum = sum + (c.x + c.y + c.z);
    const pack<T> nothing = sum * T(0);  // 0; NaN where a number is none
    const T radii = a.shape->radius + b.shape->radius, apart = enough + radii;
    const pack<T> core = convex_detail::ordered_distance(*a.shape, *b.shape, f, nothing, apart);
    const pack<T> found = core - radii;
    return select(pack<T>(apart) <= core, max(found, pack<T>(enough)), found) + nothing;
}

}  // namespace SPACEARM_NAMESPACE
