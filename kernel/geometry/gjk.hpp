// The lower bound of the distance of two convex cores, by GJK (Gilbert, Johnson and Keerthi, 1988) on packs.
//
// A lane keeps up to three points of A - B, and adds one with each step. The nearest point of these to the origin gives
// the next direction. All parts that contain the new point are tried, and the nearest is taken: no case distinction
// can go wrong by rounding. Directions are computed so that they are square to the edge or the triangle to the last
// place: where bodies are close, the least tilt costs distance.
#pragma once

#include <cstdint>
#include <limits>

#include "geometry/distance.hpp"

namespace SPACEARM_NAMESPACE {

enum class core_kind : std::uint8_t { segment, box, cylinder, polytope };  // a point is a segment of half length 0

// In the core's own frame. half: of a segment (0, 0, half length), along z; of a box its half edges; of a cylinder
// (radius, radius, half length), along z; of a polytope not used. The shape is all within `radius` of the core.
template <class T> struct convex_shape {
    core_kind kind;
    T half[3];
    T radius;
    int count;               // of vertices: a polytope's
    const T (*vertices)[3];  // their hull, which may be flat
};
template <class T> struct placed_shape {
    const convex_shape<T>* shape;
    vec3<T> axis[3],
        origin;  // the core's, in any frame that both shapes have in common; of a segment only axis[2] is read
};

namespace convex_detail {

template <class T> SPACEARM_INLINE vec3<T> select3(const pack_mask<T>& m, const vec3<T>& a, const vec3<T>& b) {
    return {select(m, a.x, b.x), select(m, a.y, b.y), select(m, a.z, b.z)};
}
template <class T> SPACEARM_INLINE pack<T> length_of(const vec3<T>& v) { return sqrt(dot(v, v)); }

// A point of a core that is furthest along a direction, in the core's own frame.
template <core_kind K, class T> SPACEARM_INLINE_REGISTERS vec3<T> furthest(const convex_shape<T>& s, const vec3<T>& n) {
    const pack<T> zero(T(0));
    if constexpr (K == core_kind::segment) {
        return {zero, zero, with_sign_of(pack<T>(s.half[2]), n.z)};
    } else if constexpr (K == core_kind::box) {
        return {with_sign_of(pack<T>(s.half[0]), n.x), with_sign_of(pack<T>(s.half[1]), n.y),
                with_sign_of(pack<T>(s.half[2]), n.z)};
    } else if constexpr (K == core_kind::cylinder) {
        // Along its axis all points of a lid are as far: its middle.
        const pack<T> across = sqrt(n.x * n.x + n.y * n.y), tiny(std::numeric_limits<T>::min());
        const pack<T> factor = select(tiny < across, s.half[0] / max(across, tiny), zero);
        return {n.x * factor, n.y * factor, with_sign_of(pack<T>(s.half[2]), n.z)};
    } else {
        vec3<T> at = constant(s.vertices[0]);
        pack<T> most = dot(n, s.vertices[0]);
        for (int i = 1; i < s.count; ++i) {
            const T* p = s.vertices[i];
            const pack<T> along = dot(n, p);
            at = select3(most < along, constant(p), at);
            most = max(most, along);
        }
        return at;
    }
}

// ---- directions that are often the best, and all that matter where two boxes overlap (Gottschalk, 1996)
// ----------------

// How far a core goes along a direction from its middle, either way: of all but polytopes.
template <core_kind K, class T>
SPACEARM_INLINE_REGISTERS pack<T> reach_along(const convex_shape<T>& s, const vec3<T>& n) {
    const pack<T> along = abs(n.z) * s.half[2];
    if constexpr (K == core_kind::segment) return along;
    else if constexpr (K == core_kind::box) return abs(n.x) * s.half[0] + abs(n.y) * s.half[1] + along;
    else return sqrt(n.x * n.x + n.y * n.y) * s.half[0] + along;
}
// The direction square to two others, where these are not parallel to the last places; else none, which is 0.
template <class T> SPACEARM_INLINE_REGISTERS vec3<T> square_to(const vec3<T>& a, const vec3<T>& b) {
    const pack<T> zero(T(0)), tiny(std::numeric_limits<T>::min());
    constexpr T parallel = 64 * std::numeric_limits<T>::epsilon();
    const vec3<T> n = cross(a, b);
    const pack<T> squared = dot(n, n);
    const pack_mask<T> sound = dot(a, a) * dot(b, b) * (parallel * parallel) < squared;
    return scaled(n, select(sound, pack<T>(T(1)) / sqrt(max(squared, tiny)), zero));
}

// Two cores, in A's frame; A - B is what is searched.
template <core_kind A, core_kind B, class T> struct core_pair {
    const convex_shape<T>&a, &b;
    const frame<T> b_in_a;
    static constexpr bool symmetric = A != core_kind::polytope && B != core_kind::polytope;

    vec3<T> between() const { return b_in_a.origin; }
    // A point of A - B that is least far along a direction.
    SPACEARM_INLINE_REGISTERS vec3<T> least_along(const vec3<T>& n) const {
        const pack<T> zero(T(0));
        const frame<T>& f = b_in_a;
        const vec3<T> p = furthest<A>(a, vec3<T>{zero - n.x, zero - n.y, zero - n.z});
        const vec3<T> q = furthest<B>(b, seen_from_b(n));
        return {p.x - (f.origin.x + (f.column[0].x * q.x + f.column[1].x * q.y + f.column[2].x * q.z)),
                p.y - (f.origin.y + (f.column[0].y * q.x + f.column[1].y * q.y + f.column[2].y * q.z)),
                p.z - (f.origin.z + (f.column[0].z * q.x + f.column[1].z * q.y + f.column[2].z * q.z))};
    }
    // Raises the bound by the normals of flat faces; n becomes the best of them, if one is better.
    SPACEARM_INLINE void try_faces(vec3<T>& n, pack<T>& lower) const {
        if constexpr (symmetric) {
            const pack<T> zero(T(0)), one(T(1));
            for (int k = A == core_kind::box ? 0 : 2; k < 3; ++k)
                take({k == 0 ? one : zero, k == 1 ? one : zero, k == 2 ? one : zero}, n, lower);
            for (int k = B == core_kind::box ? 0 : 2; k < 3; ++k) take(b_in_a.column[k], n, lower);
        }
    }
    // The same by what is square to an edge, or to the side of a cylinder, of each.
    SPACEARM_INLINE void try_edges(pack<T>& lower) const {
        if constexpr (symmetric) {
            const pack<T> zero(T(0)), one(T(1));
            vec3<T> n{zero, zero, zero};
            for (int k = A == core_kind::box ? 0 : 2; k < 3; ++k) {
                const vec3<T> axis{k == 0 ? one : zero, k == 1 ? one : zero, k == 2 ? one : zero};
                for (int l = B == core_kind::box ? 0 : 2; l < 3; ++l) take(square_to(axis, b_in_a.column[l]), n, lower);
                if constexpr (A == core_kind::cylinder) take(square_to(square_to(axis, b_in_a.origin), axis), n, lower);
            }
            if constexpr (B == core_kind::cylinder) {
                const vec3<T>& axis = b_in_a.column[2];
                take(square_to(square_to(axis, b_in_a.origin), axis), n, lower);
            }
        }
    }

  private:
    SPACEARM_INLINE vec3<T> seen_from_b(const vec3<T>& n) const {
        return {dot(b_in_a.column[0], n), dot(b_in_a.column[1], n), dot(b_in_a.column[2], n)};
    }
    SPACEARM_INLINE_REGISTERS void take(const vec3<T>& towards, vec3<T>& n, pack<T>& lower) const {
        const pack<T> zero(T(0)), to = dot(towards, b_in_a.origin),
                                  size = abs(towards.x) + abs(towards.y) + abs(towards.z);
        const pack<T> g = abs(to) - (reach_along<A>(a, towards) + reach_along<B>(b, seen_from_b(towards)));
        const pack_mask<T> better = (lower < g) & (zero < size), away = zero < to;
        n = select3(better, select3(away, vec3<T>{zero - towards.x, zero - towards.y, zero - towards.z}, towards), n);
        lower = select(better, g, lower);
    }
};
// A core and a segment, its middle and half of it given in the core's frame.
template <core_kind A, class T> struct segment_pair {
    const convex_shape<T>& a;
    const vec3<T> middle, half;
    static constexpr bool symmetric = A != core_kind::polytope;

    vec3<T> between() const { return middle; }
    SPACEARM_INLINE_REGISTERS vec3<T> least_along(const vec3<T>& n) const {
        const pack<T> zero(T(0));
        const vec3<T> p = furthest<A>(a, vec3<T>{zero - n.x, zero - n.y, zero - n.z});
        const pack_mask<T> back = dot(half, n) < zero;
        const vec3<T> from = p - middle;
        return select3(back, from + half, from - half);
    }
    SPACEARM_INLINE void try_faces(vec3<T>& n, pack<T>& lower) const {
        if constexpr (symmetric) {
            const pack<T> zero(T(0)), one(T(1));
            for (int k = A == core_kind::box ? 0 : 2; k < 3; ++k)
                take({k == 0 ? one : zero, k == 1 ? one : zero, k == 2 ? one : zero}, n, lower);
        }
    }
    SPACEARM_INLINE void try_edges(pack<T>& lower) const {
        if constexpr (symmetric) {
            const pack<T> zero(T(0)), one(T(1));
            vec3<T> n{zero, zero, zero};
            for (int k = A == core_kind::box ? 0 : 2; k < 3; ++k) {
                const vec3<T> axis{k == 0 ? one : zero, k == 1 ? one : zero, k == 2 ? one : zero};
                take(square_to(axis, half), n, lower);
                if constexpr (A == core_kind::cylinder) take(square_to(square_to(axis, middle), axis), n, lower);
            }
        }
    }

  private:
    SPACEARM_INLINE_REGISTERS void take(const vec3<T>& towards, vec3<T>& n, pack<T>& lower) const {
        const pack<T> zero(T(0)), to = dot(towards, middle), size = abs(towards.x) + abs(towards.y) + abs(towards.z);
        const pack<T> g = abs(to) - (reach_along<A>(a, towards) + abs(dot(half, towards)));
        const pack_mask<T> better = (lower < g) & (zero < size), away = zero < to;
        n = select3(better, select3(away, vec3<T>{zero - towards.x, zero - towards.y, zero - towards.z}, towards), n);
        lower = select(better, g, lower);
    }
};

template <class T> struct gjk_bounds {
    pack<T> lower;  // of the signed distance
    pack<T> slack;  // what it may lack by rounding
};

// Up to three points of A - B, the newest first; what is not used repeats it.
template <class T> struct simplex {
    vec3<T> point[3];
    vec3<T> nearest;  // to the origin; as a direction square to the edge or the triangle that it lies on
};

// A part of a simplex, if it is nearer than what is known.
template <class T>
SPACEARM_INLINE_REGISTERS void take_nearer(const pack_mask<T>& nearer, const vec3<T>& at, const pack<T>& squared,
                                           const vec3<T>& second, const vec3<T>& third, simplex<T>& s, pack<T>& least) {
    s.nearest = select3(nearer, at, s.nearest);
    least = select(nearer, squared, least);
    s.point[1] = select3(nearer, second, s.point[1]);
    s.point[2] = select3(nearer, third, s.point[2]);
}

// Adds a point to a simplex of one point, or of up to three, and keeps the part that is nearest to the origin. Returns
// where the four points enclose the origin.
template <int points, class T>
SPACEARM_INLINE_REGISTERS pack_mask<T> reduce(const vec3<T>& w, simplex<T>& s, pack<T>& least) {
    const pack<T> zero(T(0)), one(T(1)), tiny(std::numeric_limits<T>::min());
    vec3<T> y[points], e[points];
    pack<T> ee[points], we[points];
    for (int i = 0; i < points; ++i) {
        y[i] = s.point[i];
        e[i] = y[i] - w;
        ee[i] = dot(e[i], e[i]);
        we[i] = zero - dot(w, e[i]);
    }
    s.point[0] = s.point[1] = s.point[2] = w;
    s.nearest = w;
    least = dot(w, w);
    for (int i = 0; i < points; ++i) {
        const pack<T> inverse = one / max(ee[i], tiny), t = min(max(we[i] * inverse, zero), one);
        vec3<T> at{w.x + e[i].x * t, w.y + e[i].y * t, w.z + e[i].z * t};
        // Once more square to the edge, where the nearest point is between its ends.
        const pack<T> rest = select((zero < t) & (t < one), dot(at, e[i]) * inverse, zero);
        at = at - scaled(e[i], rest);
        const pack<T> squared = dot(at, at);
        take_nearer((zero < t) & (squared < least), at, squared, y[i], y[i], s, least);
    }
    if constexpr (points == 1) return one < zero;
    else {
        constexpr T eps = std::numeric_limits<T>::epsilon();
        pack<T> outward[3];
        vec3<T> normal[3];
        for (int i = 0; i < 3; ++i) {
            const int k = (i + 1) % 3;
            const vec3<T> n = cross(e[i], e[k]);
            const pack<T> nn = dot(n, n), nw = dot(n, w), ek = dot(e[i], e[k]);
            const pack<T> one_share = we[i] * ee[k] - we[k] * ek, other_share = we[k] * ee[i] - we[i] * ek;
            const pack_mask<T> sound = ee[i] * ee[k] * T(16 * eps * eps) < nn;
            const pack<T> factor = nw / max(nn, tiny), squared = nw * factor;
            const pack_mask<T> within = (zero <= one_share) & (zero <= other_share) & (one_share + other_share <= nn);
            take_nearer(sound & within & (squared < least), scaled(n, factor), squared, y[i], y[k], s, least);
            normal[i] = n;
            outward[i] = zero - nw;
        }
        const pack<T> volume = dot(normal[0], e[2]), side = select(volume < zero, -one, one);
        const pack<T> a = outward[0] * side, b = outward[1] * side, c = outward[2] * side, v = volume * side;
        return (zero <= a) & (zero <= b) & (zero <= c) & (a + b + c <= v) & (zero < v);
    }
}

template <class Pair, class T>
SPACEARM_INLINE_REGISTERS gjk_bounds<T> gjk(const Pair& pair, const pack<T>& nothing, T enough) {
    constexpr bool single = sizeof(T) == 4;
    constexpr int most_steps = single ? 32 : 64;
    constexpr T close = single ? T(1e-4) : T(1e-12);  // [m/m] of the distance: what the bounds may leave open
    const pack<T> zero(T(0)), one(T(1)), tiny(std::numeric_limits<T>::min());
    constexpr T rounding = 16 * std::numeric_limits<T>::epsilon();
    const auto unit = [&](const vec3<T>& v, const pack<T>& size) {
        const pack<T> inverse = one / max(size, tiny);
        return vec3<T>{select(tiny < size, v.x * inverse, one), v.y * inverse, v.z * inverse};
    };
    const vec3<T> to = pair.between();
    vec3<T> n = unit(vec3<T>{zero - to.x, zero - to.y, zero - to.z}, length_of(to));
    vec3<T> w = pair.least_along(n);
    simplex<T> s{{w, w, w}, w};
    pack<T> lower = dot(n, w), upper = length_of(w), widest = upper, least = upper * upper;
    pack_mask<T> active = (lower < enough) & (nothing <= zero);
    if (any(active)) {
        n = unit(w, upper);
        pack<T> of_faces = lower;
        pair.try_faces(n, of_faces);
        lower = select(active, of_faces, lower);
    }
    for (int i = 0; i < most_steps; ++i) {
        active = active & (upper * close + widest * rounding < upper - lower) & (tiny < upper) & (lower < enough);
        if (!any(active)) break;
        if (i > 0) n = unit(s.nearest, upper);
        w = pair.least_along(n);
        lower = select(active, max(lower, dot(n, w)), lower);
        widest = select(active, max(widest, abs(w.x) + abs(w.y) + abs(w.z)), widest);
        active = active & (upper * close + widest * rounding < upper - lower) & (lower < enough);
        if (!any(active)) break;
        const pack<T> before = least;
        // Where the four points enclose the origin, the cores overlap. Where nothing came nearer, rounding rules.
        if (i == 0) reduce<1>(w, s, least);  // its direction is not that of the nearest point
        else {
            const pack_mask<T> enclosed = reduce<3>(w, s, least);
            least = select(enclosed, zero, least);
            active = active & (least < before);
        }
        upper = select(active, sqrt(least), upper);
    }
    return {lower, widest * rounding};
}

}  // namespace convex_detail
}  // namespace SPACEARM_NAMESPACE
