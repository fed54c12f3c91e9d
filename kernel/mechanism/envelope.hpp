// The envelope of a robot, the bodies of its links, among obstacles, arranged so that pairs far apart cost next to
// nothing.
//
// Most bodies are capsules and spheres; solids.hpp has the others. The bodies of a link make a cluster with a bounding
// sphere. Obstacles stand in a tree of boxes along the axes. Cluster against tree, then bounding sphere against shape,
// then body against shape: only pairs that are near in some lane go on.
#pragma once

#include <algorithm>
#include <cmath>

#include "mechanism/solids.hpp"

namespace SPACEARM_NAMESPACE {

template <class T> struct link_body {
    T a[3], ab[3];             // the axis of a capsule, in the joint's frame
    T inverse_squared_length;  // 0 for a sphere, and for what is no capsule
    T radius;
    T middle[3], reach;  // its bounding sphere
    int index;           // its place in the robot's own list
    int solid = -1;      // which of the solids it is, if it is no capsule
};
template <class T> struct cluster {
    int joint;                                             // -1 for the base
    int first, last;                                       // its bodies
    bool has_solids;                                       // whether any is no capsule
    T center[3], radius;                                   // their bounding sphere
    T greatest_margin = std::numeric_limits<T>::lowest();  // [m] of its own ones with obstacles
};
template <class T> struct pair_margin {
    int cluster, other;  // and a node of the obstacles' tree; or -1 and the number of a pair of clusters
    T margin;            // [m] is asked for between the two, instead of what is asked for between all others
    bool before(int c, int o) const { return cluster != c ? cluster < c : other < o; }
};
// The clearance that is asked for: either the one that is required, or a preferred one. Pairs with a margin of their
// own have to keep that; where it is lower than what is required of all others, no more than that is preferred either.
template <class T> struct asked_clearance {
    T margin;  // [m] of the pairs without a margin of their own
    bool preferred = false;
    T required = T(0);  // [m] the margin that is required, where this one is preferred
    T of_pair(T own) const {
        if (!preferred) return own;
        return own < required ? std::min(margin, own) : margin;
    }
    // No pair of a cluster and an obstacle is asked for more than this.
    T greatest(const cluster<T>& c) const { return preferred ? margin : std::max(margin, c.greatest_margin); }
};
template <class T> struct link_envelope {
    std::vector<link_body<T>> bodies;
    std::vector<link_solid<T>> solids;  // the bodies that are no capsules
    std::vector<cluster<T>> clusters;
    std::vector<std::pair<int, int>> pairs;    // clusters that must keep clear of each other
    std::vector<pair_margin<T>> pair_margins;  // in order, of each pair one at most; mostly none

    T margin_of(int c, int other, const asked_clearance<T>& asked) const {
        const auto at = std::lower_bound(pair_margins.begin(), pair_margins.end(), 0,
                                         [&](const pair_margin<T>& e, int) { return e.before(c, other); });
        const bool own = at != pair_margins.end() && at->cluster == c && at->other == other;
        return own ? asked.of_pair(at->margin) : asked.margin;
    }
};

// ---- the envelope of one pack of configurations ---------------------------------------------------------------------
template <class T> struct envelope_memory {
    std::vector<vec3<T>> centers;         // of the clusters' bounding spheres
    std::vector<vec3<T>> a, ab, middle;   // of the bodies, once their cluster's are placed
    std::vector<placed_shape<T>> solids;  // likewise
    std::vector<char> bodies_placed;
    const frame<T>* base = nullptr;  // where the base is; none: where it was at the beginning
    envelope_memory() = default;
    explicit envelope_memory(const link_envelope<T>& b)
        : centers(b.clusters.size()), a(b.bodies.size()), ab(b.bodies.size()), middle(b.bodies.size()),
          solids(b.solids.size()), bodies_placed(b.clusters.size()) {}
};

template <class T>
SPACEARM_INLINE void place(const link_envelope<T>& b, const frame<T>* frames, envelope_memory<T>& w) {
    for (std::size_t i = 0; i < b.clusters.size(); ++i) {
        const cluster<T>& c = b.clusters[i];
        w.centers[i] = c.joint >= 0 ? carry(frames[c.joint], c.center)
                       : w.base     ? carry(*w.base, c.center)
                                    : constant(c.center);
        w.bodies_placed[i] = 0;
    }
}

template <class T>
inline void place_bodies(const link_envelope<T>& b, const frame<T>* frames, int i, envelope_memory<T>& w) {
    if (w.bodies_placed[i]) return;
    w.bodies_placed[i] = 1;
    const cluster<T>& c = b.clusters[i];
    const frame<T> base = w.base ? *w.base : base_frame<T>();
    const frame<T>& f = c.joint < 0 ? base : frames[c.joint];
    for (int k = c.first; k < c.last; ++k) {
        const link_body<T>& body = b.bodies[k];
        w.a[k] = carry(f, body.a);
        if (body.inverse_squared_length == T(0)) {
            w.middle[k] = w.a[k];
            if (body.solid >= 0) w.solids[body.solid] = placed(b.solids[body.solid], f);
            continue;
        }
        w.ab[k] = rotate(f, body.ab);
        w.middle[k] = carry(f, body.middle);
    }
}

template <class T>
SPACEARM_INLINE placed_solid<T> solid_of(const link_envelope<T>& b, const envelope_memory<T>& w, int k) {
    const link_body<T>& body = b.bodies[k];
    const link_solid<T>& s = b.solids[body.solid];
    return {w.solids[body.solid], s.half, s.reach, s.rod};
}
template <class T>
SPACEARM_INLINE placed_axis<T> axis_of(const link_envelope<T>& b, const envelope_memory<T>& w, int k) {
    const link_body<T>& body = b.bodies[k];
    return {w.middle[k], w.a[k], w.ab[k], body.inverse_squared_length, body.radius, body.reach};
}
// The clearance of a body and an obstacle, and of two bodies; lanes at `enough` or beyond may return any lower bound of
// at least `enough`.
template <class T, class Shape>
SPACEARM_NOINLINE pack<T> body_clearance(const link_envelope<T>& b, const envelope_memory<T>& w, int k, const Shape& o,
                                         T enough, bool depth) {
    if (b.bodies[k].solid >= 0) return obstacle_clearance(solid_of(b, w, k), o, enough, depth);
    return obstacle_clearance(axis_of(b, w, k), o, enough, depth);
}
template <class T>
SPACEARM_NOINLINE pack<T> body_clearance(const link_envelope<T>& b, const envelope_memory<T>& w, int k, int l, T enough,
                                         bool depth) {
    const bool one = b.bodies[k].solid >= 0, two = b.bodies[l].solid >= 0;
    if (one && two) return solid_clearance(solid_of(b, w, k), solid_of(b, w, l), enough, depth);
    return one ? axis_clearance(solid_of(b, w, k), axis_of(b, w, l), enough, depth)
               : axis_clearance(solid_of(b, w, l), axis_of(b, w, k), enough, depth);
}

// Whether the capsules of a cluster are measured by their axes' distance from an obstacle; its other bodies never are.
template <class T, class Shape> inline constexpr bool has_axis_distance = !std::is_same_v<Shape, polytope_obstacle<T>>;

// ---- what is made of a pack's clearances ----------------------------------------------------------------------------
// By how much they fall short of the margin [m], summed over all pairs, lane by lane. With stop_early the sum is only
// known to be above 0 in some lane, or 0 in all.
template <class T> struct shortfall_sum {
    bool stop_early;
    pack<T> sum{T(0)};
    bool depth() const { return !stop_early; }  // whether it matters by how much they fall short
    SPACEARM_INLINE bool far(const pack_mask<T>& beyond) const { return all(beyond); }
    SPACEARM_INLINE void take(T required, const pack<T>& is) { sum += above_zero(pack<T>(required) - is); }
    bool over() const { return stop_early && !all(sum <= T(0)); }
};

// Which lanes are free. Those that are known not to be cost nothing more.
template <class T> class free_lanes {
  public:
    free_lanes() {
        std::fill(free_, free_ + W, T(1));
        out_ = pack<T>::load(free_) <= T(0);
    }
    bool depth() const { return false; }
    SPACEARM_INLINE bool far(const pack_mask<T>& beyond) const { return all(beyond | out_); }
    SPACEARM_INLINE void take(T required, const pack<T>& is) {
        const pack_mask<T> clear = pack<T>(required) <= is;  // not so where a number is none
        if (!far(clear)) leave_out(clear);
    }
    bool over() const { return left_ == 0; }
    bool is_free(int lane) const { return free_[lane] > T(0); }

  private:
    SPACEARM_NOINLINE void leave_out(const pack_mask<T>& clear) {
        select(clear, pack<T>::load(free_), pack<T>(T(0))).store(free_);
        left_ = 0;
        for (int i = 0; i < W; ++i) left_ += free_[i] > T(0);
        out_ = pack<T>::load(free_) <= T(0);
    }
    static constexpr int W = lanes_of<T>;
    int left_ = W;  // that may be free
    T free_[W];     // 1 or 0
    pack_mask<T> out_;
};

template <class T, class Shape, class Result>
SPACEARM_NOINLINE void compare_solids(const link_envelope<T>& b, int i, const Shape& o, T margin,
                                      const envelope_memory<T>& w, Result& result) {
    const cluster<T>& c = b.clusters[i];
    for (int k = c.first; k < c.last; ++k) {
        if (result.far(pack<T>(b.bodies[k].reach + margin + rounding_of<T>(o)) <= distance_to(o, w.middle[k])))
            continue;
        result.take(margin, body_clearance(b, w, k, o, margin, result.depth()));
    }
}

// For each body of a cluster and an obstacle: the distance that is required of their axes or cores, and what it is.
template <class T, class Shape, class Result>
SPACEARM_INLINE void compare(const link_envelope<T>& b, const frame<T>* frames, int i, const Shape& o, T asked,
                             envelope_memory<T>& w, Result& result) {
    const cluster<T>& c = b.clusters[i];
    const T margin = asked + rounding_of<T>(o);
    if (result.far(pack<T>(c.radius + margin) <= distance_to(o, w.centers[i]))) return;
    place_bodies(b, frames, i, w);
    if (!has_axis_distance<T, Shape> || c.has_solids) return compare_solids(b, i, o, asked, w, result);
    for (int k = c.first; k < c.last; ++k) {
        const link_body<T>& body = b.bodies[k];
        const pack<T> from_middle = distance_to(o, w.middle[k]);
        if (result.far(pack<T>(body.reach + margin) <= from_middle)) continue;
        pack<T> d = from_middle;
        if (body.inverse_squared_length != T(0)) {
            // A distance changes by no more than the displacement: between the middle and an end no point is nearer
            // than half of both distances less a quarter of the length.
            const pack<T> nearest_end = min(distance_to(o, w.a[k]), distance_to(o, w.a[k] + w.ab[k]));
            const T quarter = (body.reach - body.radius) * T(0.5);
            if (result.far(pack<T>(body.radius + margin + quarter) <= (from_middle + nearest_end) * T(0.5))) continue;
            d = axis_distance(o, w.a[k], w.ab[k], body.inverse_squared_length);
        }
        result.take(body.radius + margin, d);
    }
}

template <class T, class Result>
inline void compare_obstacles(const link_envelope<T>& b, const frame<T>* frames, const obstacle_set<T>& obstacles,
                              const asked_clearance<T>& asked, envelope_memory<T>& w, Result& result) {
    const bool by_pair = !b.pair_margins.empty();
    const int nodes = static_cast<int>(obstacles.tree.size());
    for (int i = static_cast<int>(b.clusters.size()) - 1; i >= 0; --i) {  // the last link first: it collides most
        const cluster<T>& c = b.clusters[i];
        if (c.joint < 0 && !w.base) continue;  // the base and the obstacles stand still
        const T reach = c.radius + (by_pair ? asked.greatest(c) : asked.margin);
        for (int k = 0; k < nodes;) {
            const obstacle_node<T>& node = obstacles.tree[k];
            if (result.far(beyond_box(w.centers[i], reach, node))) {
                k = node.skip;
                continue;
            }
            if (node.kind != shape::none) {
                const T margin = by_pair ? b.margin_of(i, k, asked) : asked.margin;
                obstacles.visit(node.kind, node.index,
                                [&](const auto& o) { compare(b, frames, i, o, margin, w, result); });
            }
            ++k;
        }
        if (result.over()) return;
    }
}

// Between the axes of two capsules that are in place.
template <class T>
SPACEARM_INLINE pack<T> squared_distance(const link_envelope<T>& b, const envelope_memory<T>& w, int k, int l) {
    const link_body<T>&c = b.bodies[k], &d = b.bodies[l];
    if (c.inverse_squared_length == T(0) && d.inverse_squared_length == T(0)) {
        const vec3<T> between = w.a[k] - w.a[l];
        return dot(between, between);
    }
    const pack<T> zero(T(0));
    const vec3<T> none{zero, zero, zero};
    return squared_distance_of_axes(w.a[k], c.inverse_squared_length == T(0) ? none : w.ab[k], c.inverse_squared_length,
                                    w.a[l], d.inverse_squared_length == T(0) ? none : w.ab[l],
                                    d.inverse_squared_length);
}
template <class T>
SPACEARM_INLINE pack<T> capsule_clearance(const link_envelope<T>& b, const envelope_memory<T>& w, int k, int l) {
    return sqrt(squared_distance(b, w, k, l)) - (b.bodies[k].radius + b.bodies[l].radius);
}

// Whether the only body of a cluster is a solid, and the box around it is far from a bounding sphere.
template <class T>
SPACEARM_INLINE bool lone_solid_is_far(const link_envelope<T>& b, const envelope_memory<T>& w, int i,
                                       const vec3<T>& center, T reach, T margin) {
    const cluster<T>& c = b.clusters[i];
    if (c.last - c.first > 1 || b.bodies[c.first].solid < 0) return false;
    return box_is_far(solid_of(b, w, c.first), center, reach, margin);
}

template <class T, class Result>
SPACEARM_NOINLINE void compare_two_links(const link_envelope<T>& b, int i, int j, T margin, const envelope_memory<T>& w,
                                         Result& result) {
    const cluster<T>&one = b.clusters[i], &two = b.clusters[j];
    if (lone_solid_is_far(b, w, i, w.centers[j], two.radius, margin)) return;
    if (lone_solid_is_far(b, w, j, w.centers[i], one.radius, margin)) return;
    for (int k = one.first; k < one.last; ++k) {
        for (int l = two.first; l < two.last; ++l) {
            const link_body<T>&c = b.bodies[k], &d = b.bodies[l];
            const vec3<T> between = w.middle[k] - w.middle[l];
            const T reach = c.reach + d.reach + margin;
            if (result.far(pack<T>(reach * reach) <= dot(between, between))) continue;
            result.take(margin, c.solid >= 0 || d.solid >= 0 ? body_clearance(b, w, k, l, margin, result.depth())
                                                             : capsule_clearance(b, w, k, l));
        }
    }
}

template <class T, class Result>
inline void compare_links(const link_envelope<T>& b, const frame<T>* frames, const asked_clearance<T>& asked,
                          envelope_memory<T>& w, Result& result) {
    const bool by_pair = !b.pair_margins.empty();
    for (std::size_t p = 0; p < b.pairs.size(); ++p) {
        const auto& [i, j] = b.pairs[p];
        const T margin = by_pair ? b.margin_of(-1, static_cast<int>(p), asked) : asked.margin;
        const cluster<T>&one = b.clusters[i], &two = b.clusters[j];
        const vec3<T> apart = w.centers[i] - w.centers[j];
        const T near = one.radius + two.radius + margin;
        if (result.far(pack<T>(near * near) <= dot(apart, apart))) continue;
        place_bodies(b, frames, i, w);
        place_bodies(b, frames, j, w);
        if (one.has_solids || two.has_solids) {
            compare_two_links(b, i, j, margin, w, result);
            if (result.over()) return;
            continue;
        }
        for (int k = one.first; k < one.last; ++k) {
            const link_body<T>& c = b.bodies[k];
            const vec3<T> to = w.middle[k] - w.centers[j];
            const T from = c.reach + two.radius + margin;
            if (result.far(pack<T>(from * from) <= dot(to, to))) continue;
            for (int l = two.first; l < two.last; ++l) {
                const link_body<T>& d = b.bodies[l];
                const vec3<T> between = w.middle[k] - w.middle[l];
                const T reach = c.reach + d.reach + margin;
                if (result.far(pack<T>(reach * reach) <= dot(between, between))) continue;
                const pack<T> d2 = squared_distance(b, w, k, l);
                result.take(c.radius + d.radius + margin, sqrt(d2));
            }
        }
        if (result.over()) return;
    }
}

template <class T, class Result>
inline void compare_all(const link_envelope<T>& b, const frame<T>* frames, const obstacle_set<T>& obstacles,
                        const asked_clearance<T>& asked, envelope_memory<T>& w, Result& result) {
    place(b, frames, w);
    compare_obstacles(b, frames, obstacles, asked, w, result);
    if (!result.over()) compare_links(b, frames, asked, w, result);
}

// Shortfall of clearance [m] of one pack of configurations, summed over all pairs. With stop_early it is only known to
// be above 0 in some lane, or 0 in all. Infinite where a number is none: nobody knows where the arm is then.
template <class T>
inline pack<T> shortfall(const link_envelope<T>& b, const frame<T>* frames, const obstacle_set<T>& obstacles,
                         const asked_clearance<T>& asked, envelope_memory<T>& w, bool stop_early) {
    shortfall_sum<T> result{stop_early};
    compare_all(b, frames, obstacles, asked, w, result);
    const pack<T> infinite(std::numeric_limits<T>::infinity());
    return select(result.sum <= infinite, result.sum, infinite);
}

// ---- of pairs that are looked at one by one -------------------------------------------------------------------------
// The least clearance [m] of a cluster and an obstacle, the envelope in place; only those below `enough` are computed.
template <class T, class Shape>
SPACEARM_INLINE pack<T> cluster_clearance(const link_envelope<T>& b, const frame<T>* frames, int i, const Shape& o,
                                          T enough, envelope_memory<T>& w) {
    const cluster<T>& c = b.clusters[i];
    pack<T> least(enough);
    const T apart = enough + rounding_of<T>(o);
    if (all(pack<T>(c.radius + apart) <= distance_to(o, w.centers[i]))) return least;
    place_bodies(b, frames, i, w);
    for (int k = c.first; k < c.last; ++k) {
        const link_body<T>& body = b.bodies[k];
        const pack<T> from_middle = distance_to(o, w.middle[k]);
        if (all(pack<T>(body.reach + apart) <= from_middle)) continue;
        least = min(least, body_clearance(b, w, k, o, enough, false));
    }
    return least;
}
// The same of two clusters.
template <class T>
inline pack<T> cluster_pair_clearance(const link_envelope<T>& b, const frame<T>* frames, int i, int j, T enough,
                                      envelope_memory<T>& w) {
    const cluster<T>&one = b.clusters[i], &two = b.clusters[j];
    pack<T> least(enough);
    const vec3<T> apart = w.centers[i] - w.centers[j];
    const T near = one.radius + two.radius + enough;
    if (all(pack<T>(near * near) <= dot(apart, apart))) return least;
    place_bodies(b, frames, i, w);
    place_bodies(b, frames, j, w);
    for (int k = one.first; k < one.last; ++k) {
        for (int l = two.first; l < two.last; ++l) {
            const link_body<T>&c = b.bodies[k], &d = b.bodies[l];
            const vec3<T> between = w.middle[k] - w.middle[l];
            const T reach = c.reach + d.reach + enough;
            if (all(pack<T>(reach * reach) <= dot(between, between))) continue;
            least = min(least, c.solid >= 0 || d.solid >= 0 ? body_clearance(b, w, k, l, enough, false)
                                                            : capsule_clearance(b, w, k, l));
        }
    }
    return least;
}

// ---- building -------------------------------------------------------------------------------------------------------
// The bounding sphere of some bodies: its centre moves towards the body that reaches furthest (Badoiu and
// Clarkson, 2003).
template <class T>
void bounding_sphere(const link_envelope<T>& b, int first, int last, double (&center)[3], double& radius) {
    for (int k = 0; k < 3; ++k) {
        center[k] = 0;
        for (int i = first; i < last; ++i) center[k] += double(b.bodies[i].middle[k]) / (last - first);
    }
    if (last - first == 1) {
        radius = double(b.bodies[first].reach) * (1 + 1e-6) + 1e-6;
        return;
    }
    for (int step = 2; step < 300; ++step) {
        radius = -1;
        int furthest = first;
        for (int i = first; i < last; ++i) {
            const auto& m = b.bodies[i].middle;
            const double x = m[0] - center[0], y = m[1] - center[1], z = m[2] - center[2];
            const double r = std::sqrt(x * x + y * y + z * z) + double(b.bodies[i].reach);
            if (r > radius) {
                radius = r;
                furthest = i;
            }
        }
        if (step == 299) break;
        for (int k = 0; k < 3; ++k) center[k] += (b.bodies[furthest].middle[k] - center[k]) / step;
    }
    radius = radius * (1 + 1e-6) + 1e-6;  // rounding must not let anything out
}
struct center_and_radius {
    double center[3], radius;
};

// Clusters of a link: the whole, or halves of it where these are worth it. Appends to `made` their indices.
// `around` is their bounding sphere, where it is known.
template <class T>
void make_clusters(link_envelope<T>& b, int joint, int first, int last, std::vector<int>& made,
                   const center_and_radius* around = nullptr) {
    constexpr int few = 4;
    constexpr double worth =
        0.8;  // a split must shrink the bounding spheres to this share; measured, as is `few`: docs/benchmarks.md
    center_and_radius whole;
    if (around) whole = *around;
    else bounding_sphere(b, first, last, whole.center, whole.radius);
    if (last - first > few) {
        int longest = 0;
        double extent = -1;
        for (int k = 0; k < 3; ++k) {
            const auto [low, high] =
                std::minmax_element(b.bodies.begin() + first, b.bodies.begin() + last,
                                    [&](const auto& x, const auto& y) { return x.middle[k] < y.middle[k]; });
            if (high->middle[k] - low->middle[k] > extent) {
                extent = high->middle[k] - low->middle[k];
                longest = k;
            }
        }
        std::stable_sort(b.bodies.begin() + first, b.bodies.begin() + last,
                         [&](const auto& x, const auto& y) { return x.middle[longest] < y.middle[longest]; });
        const int middle = (first + last) / 2;
        center_and_radius one, two;
        bounding_sphere(b, first, middle, one.center, one.radius);
        bounding_sphere(b, middle, last, two.center, two.radius);
        if (std::max(one.radius, two.radius) < worth * whole.radius) {
            make_clusters(b, joint, first, middle, made, &one);
            make_clusters(b, joint, middle, last, made, &two);
            return;
        }
    }
    const bool has_solids = std::any_of(b.bodies.begin() + first, b.bodies.begin() + last,
                                        [](const auto& body) { return body.solid >= 0; });
    cluster<T> out{joint, first, last, has_solids, {}, static_cast<T>(whole.radius)};
    for (int k = 0; k < 3; ++k) out.center[k] = static_cast<T>(whole.center[k]);
    made.push_back(static_cast<int>(b.clusters.size()));
    b.clusters.push_back(out);
}

template <class T> link_body<T> make_link_body(const link_solid<T>& s, int index) {
    link_body<T> c{};
    for (int k = 0; k < 3; ++k) c.a[k] = c.middle[k] = s.origin[k];
    c.radius = s.shape.radius;
    c.reach = s.reach;
    c.solid = index;
    return c;
}
template <class T> link_body<T> make_link_body(const double* a, const double* b, double radius) {
    link_body<T> c{};
    double squared = 0;
    for (int k = 0; k < 3; ++k) {
        c.a[k] = static_cast<T>(a[k]);
        c.ab[k] = static_cast<T>(b[k] - a[k]);
        c.middle[k] = static_cast<T>((a[k] + b[k]) / 2);
        squared += (b[k] - a[k]) * (b[k] - a[k]);
    }
    c.inverse_squared_length = squared > 0 ? static_cast<T>(1 / squared) : T(0);
    c.radius = static_cast<T>(radius);
    c.reach = static_cast<T>(radius + std::sqrt(squared) / 2);
    return c;
}

}  // namespace SPACEARM_NAMESPACE
