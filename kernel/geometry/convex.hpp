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

// What GJK leaves open: cores that overlap. Their depth is searched for one lane at a time, in double. B's axes and
// origin are given in A's frame.
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
        const T found = static_cast<T>(-penetration_depth(a, b, axes, origin, -double(bound[i])));
        bound[i] = bound[i] < found ? found : bound[i];
    }
    lower = pack<T>::load(bound);
}
template <class T> SPACEARM_INLINE vec3<T> seen_from(const placed_shape<T>& a, const vec3<T>& v) {
    return {dot(a.axis[0], v), dot(a.axis[1], v), dot(a.axis[2], v)};
}
template <class T> SPACEARM_INLINE pack<T> sum_of(const vec3<T>& v) { return v.x + v.y + v.z; }

// GJK, and where cores overlap the edges; `search` goes on with what is open then.
template <bool exact, class Pair, class T, class Search>
SPACEARM_INLINE_REGISTERS pack<T> pair_distance(const Pair& pair, const pack<T>& nothing, T enough, bool depth,
                                                const Search& search) {
    const gjk_bounds<T> found = gjk(pair, nothing, enough);
    pack<T> lower = found.lower;
    const pack_mask<T> open = (lower < -found.slack) & (lower < pack<T>(enough)) & (nothing <= pack<T>(T(0)));
    if (depth && any(open)) {
        pack<T> of_edges = lower;
        pair.try_edges(of_edges);
        lower = select(open, of_edges, lower);
        if constexpr (!exact) search(open, lower);
    }
    return lower + nothing;
}

template <core_kind A, core_kind B, class T>
SPACEARM_NOINLINE pack<T> core_distance(const placed_shape<T>& a, const placed_shape<T>& b, T enough, bool depth) {
    const frame<T> f{{seen_from(a, b.axis[0]), seen_from(a, b.axis[1]), seen_from(a, b.axis[2])},
                     seen_from(a, b.origin - a.origin)};
    const pack<T> nothing = (sum_of(f.column[0]) + sum_of(f.column[1]) + sum_of(f.column[2]) + sum_of(f.origin)) * T(0);
    constexpr bool boxes = A == core_kind::box && B == core_kind::box;  // faces and edges are all that matter
    return pair_distance<boxes>(
        core_pair<A, B, T>{*a.shape, *b.shape, f}, nothing, enough, depth,
        [&](const pack_mask<T>& open, pack<T>& lower) { search_depths(*a.shape, *b.shape, f, open, lower); });
}
template <core_kind A, class T>
SPACEARM_NOINLINE pack<T> distance_of_segment(const placed_shape<T>& segment, const placed_shape<T>& a, T enough,
                                              bool depth) {
    const vec3<T> along = seen_from(a, segment.axis[2]), middle = seen_from(a, segment.origin - a.origin);
    const vec3<T> half = scaled(along, pack<T>(segment.shape->half[2]));
    const pack<T> zero(T(0)), nothing = (sum_of(along) + sum_of(middle)) * T(0);
    const vec3<T> none{zero, zero, zero};  // a segment has no other axes
    return pair_distance<A == core_kind::box>(segment_pair<A, T>{*a.shape, middle, half}, nothing, enough, depth,
                                              [&](const pack_mask<T>& open, pack<T>& lower) {
                                                  search_depths(*a.shape, *segment.shape, {{none, none, along}, middle},
                                                                open, lower);
                                              });
}

template <class T>
SPACEARM_INLINE_REGISTERS pack<T> distance_of_segments(const placed_shape<T>& a, const placed_shape<T>& b) {
    const T p = a.shape->half[2], q = b.shape->half[2], u2 = 4 * p * p, v2 = 4 * q * q;
    const vec3<T> u = scaled(a.axis[2], pack<T>(p)), v = scaled(b.axis[2], pack<T>(q));
    const pack<T> squared = squared_distance_of_axes(a.origin - u, u + u, u2 > T(0) ? 1 / u2 : T(0), b.origin - v,
                                                     v + v, v2 > T(0) ? 1 / v2 : T(0));
    const pack<T> nothing = (sum_of(a.origin) + sum_of(u) + sum_of(b.origin) + sum_of(v)) * T(0);
    return sqrt(squared) + nothing;
}

// The kinds in the order of core_kind: the first is not after the second.
template <class T>
SPACEARM_INLINE_REGISTERS pack<T> ordered_distance(const placed_shape<T>& a, const placed_shape<T>& b, T enough,
                                                   bool depth) {
    using enum core_kind;
    const auto pair = [](core_kind one, core_kind two) { return static_cast<int>(one) * 4 + static_cast<int>(two); };
    switch (pair(a.shape->kind, b.shape->kind)) {
        case pair(segment, segment): return distance_of_segments(a, b);
        case pair(segment, box): return distance_of_segment<box>(a, b, enough, depth);
        case pair(segment, cylinder): return distance_of_segment<cylinder>(a, b, enough, depth);
        case pair(segment, polytope): return distance_of_segment<polytope>(a, b, enough, depth);
        case pair(box, box): return core_distance<box, box>(a, b, enough, depth);
        case pair(box, cylinder): return core_distance<box, cylinder>(a, b, enough, depth);
        case pair(box, polytope): return core_distance<box, polytope>(a, b, enough, depth);
        case pair(cylinder, cylinder): return core_distance<cylinder, cylinder>(a, b, enough, depth);
        case pair(cylinder, polytope): return core_distance<cylinder, polytope>(a, b, enough, depth);
        default: return core_distance<polytope, polytope>(a, b, enough, depth);
    }
}

}  // namespace convex_detail

// The signed distance of two shapes [m]: negative where they overlap, by the penetration depth. Lanes at `enough` or
// beyond may return any lower bound of at least `enough`. Without `depth`, lanes where the cores overlap may return any
// lower bound: it is below 0, and costs less. A lane with a number that is none returns NaN.
template <class T>
inline pack<T> signed_distance(const placed_shape<T>& a, const placed_shape<T>& b, T enough, bool depth = true) {
    if (b.shape->kind < a.shape->kind) return signed_distance(b, a, enough, depth);
    const T radii = a.shape->radius + b.shape->radius, apart = enough + radii;
    const pack<T> core = convex_detail::ordered_distance(a, b, apart, depth), found = core - radii;
    return select(pack<T>(apart) <= core, max(found, pack<T>(enough)), found);
}

// The least normal . x over the points x of a shape, for a unit normal.
template <class T> inline pack<T> least_along(const placed_shape<T>& a, const T* normal) {
    using enum core_kind;
    const pack<T> zero(T(0));
    const vec3<T> n{zero - dot(a.axis[0], normal), zero - dot(a.axis[1], normal), zero - dot(a.axis[2], normal)};
    const convex_shape<T>& s = *a.shape;
    pack<T> depth = abs(n.z) * s.half[2];  // of a segment
    if (s.kind == box) depth = abs(n.x) * s.half[0] + abs(n.y) * s.half[1] + depth;
    else if (s.kind == cylinder) depth = sqrt(n.x * n.x + n.y * n.y) * s.half[0] + depth;
    else if (s.kind == polytope) {
        depth = dot(n, s.vertices[0]);
        for (int i = 1; i < s.count; ++i) depth = max(dot(n, s.vertices[i]), depth);
    }
    return dot(a.origin, normal) - (depth + s.radius);
}
template <class T>
inline pack<T> signed_distance(const placed_shape<T>& a, const half_space_obstacle<T>& o, T, bool = true) {
    return least_along(a, o.normal) - o.offset;
}

}  // namespace SPACEARM_NAMESPACE
