// RRT-Connect (Kuffner and LaValle, 2000): two trees of straight edges, one from the start and one from the goals,
// grown towards each other.
//
// Its paths have corners and no timing; they only tell the search where motions may be. Distances are measured by how
// far the joints move the bodies, so that one step suits all joints of all robots. The lanes are instants along one
// edge; where most edges collide, they are the ends of as many edges first, and only those with a free end go on.
// docs/theory.md, "How the trees grow", has the rule step by step.
#pragma once

#include "lanes/random.hpp"
#include "mechanism/levers.hpp"
#include "motion/checker.hpp"

namespace SPACEARM_NAMESPACE {

template <class T> T distance_between(const T* a, const T* b, int n) {
    T sum = 0;
    for (int d = 0; d < n; ++d) sum += (a[d] - b[d]) * (a[d] - b[d]);
    return std::sqrt(sum);
}

// Straight edges from the start to one of the goals.
template <class T> struct path {
    std::vector<T> points;  // (m, n)
    int goal = 0;
    int count(int n) const { return static_cast<int>(points.size()) / n; }
    T length(int n) const {
        T sum = 0;
        for (int i = 0; i + 1 < count(n); ++i) sum += distance_between(&points[i * n], &points[(i + 1) * n], n);
        return sum;
    }
};

// Lengths are those of a joint with the mean lever (levers.hpp): other joints count by how far they move the bodies.
struct rrt_connect_settings {
    double step = 1.0;        // [rad] longest edge
    double near_line = 0.95;  // share of the samples drawn around the straight motion ...
    double spread = 1.5;      // ... with this deviation [rad]
};

template <class T> class rrt_connect {
  public:
    rrt_connect(motion_checker<T>& checker, const rrt_connect_settings& settings)
        : checker_(checker), p_(checker.problem()), settings_(settings), n_(p_.dofs()), weight_(n_, T(1)),
          spread_(n_, T(settings.spread)) {
        measure_joints();
        begin_again();
    }

    // Grows the trees by at most `tries` more, each about as long as it takes to look at an edge; true when they met.
    // go_on() is asked before every try, still() before every edge. Where numbers are so large that a step goes
    // nowhere, or limits so wide that steps do not arrive, it ends all the same.
    template <class GoOn, class Still>
    bool grow(int tries, search_sequence<T>& random, GoOn&& go_on, Still&& still, path<T>& found) {
        for (int i = 0; i < tries; ++i) {
            if (!go_on()) return false;
            if (std::max(from_start_.count(), from_goals_.count()) >= most_nodes) begin_again();
            branch& one =
                from_start_.count() <= from_goals_.count() ? from_start_ : from_goals_;  // the smaller one grows
            branch& two = &one == &from_start_ ? from_goals_ : from_start_;
            const int count = blocked_ < one_by_one ? 1 : W;
            for (int k = 0; k < count; ++k) draw(random, one, k);
            if (count > 1) drop_blocked_ends();
            for (int k = 0; k < count; ++k) {
                if (!candidate_[k].free) continue;
                if (!still()) return false;
                if (!extend(one, two, candidate_[k], still, found)) continue;
                begin_again();
                return true;
            }
        }
        return false;
    }

    // Whether the way straight from a to b is free, looked at in edges of at most a step.
    bool straight_free(const T* a, const T* b) {
        std::vector<T> from(a, a + n_), to(n_);
        const int parts = std::max(1, static_cast<int>(std::ceil(weighted_distance(a, b) / T(settings_.step))));
        for (int i = 1; i <= parts; ++i) {
            for (int d = 0; d < n_; ++d) to[d] = a[d] + (b[d] - a[d]) * T(i) / T(parts);
            if (!checker_.edge_free(from.data(), to.data())) return false;
            from = to;
        }
        return true;
    }

  private:
    static constexpr int W = lanes_of<T>;
    static constexpr int most_nodes = 1 << 18;  // of a tree; with more, the nearest takes longer than a new tree
    static constexpr int most_steps = 1 << 12;  // edges towards one sample: many times any arm's range
    static constexpr int one_by_one = 4;        // blocked edges, before ends are checked a pack at a time
    static constexpr int more_edges = 2;        // in the direction of the sample, after the first
    static constexpr T first_edge = T(0.5);     // length of the first, as a share of a step
    static constexpr T least_weight = T(0.1);   // of a joint that moves next to nothing, as a share of the mean

    // A tree's nodes; weighted as well, one row a joint, so that the nearest is looked for a pack at a time.
    struct branch {
        int n = 0;
        std::vector<T> nodes;  // (count, n)
        std::vector<std::vector<T>> rows;
        std::vector<int> parent;

        void reset(int dofs) {
            n = dofs;
            nodes.clear();
            rows.assign(n, std::vector<T>(W, far));
            parent.clear();
        }
        int count() const { return static_cast<int>(parent.size()); }
        const T* node(int i) const { return &nodes[static_cast<std::size_t>(i) * n]; }
        int add(const T* q, int from, const std::vector<T>& weight) {
            const int at = count();
            for (int d = 0; d < n; ++d) {
                if (at == static_cast<int>(rows[d].size())) rows[d].resize(2 * rows[d].size(), far);
                rows[d][at] = weight[d] * q[d];
            }
            nodes.insert(nodes.end(), q, q + n);
            parent.push_back(from);
            return at;
        }
        int nearest(const T* weighted) const {
            pack<T> best(std::numeric_limits<T>::max()), where(T(0)), here;
            T lane[W], index[W];
            for (int i = 0; i < W; ++i) lane[i] = T(i);
            here = pack<T>::load(lane);
            for (int i = 0; i < count(); i += W) {
                pack<T> squared(T(0));
                for (int d = 0; d < n; ++d) {
                    const pack<T> away = pack<T>::load(&rows[d][i]) - weighted[d];
                    squared += away * away;
                }
                const pack_mask<T> nearer = squared < best;
                best = select(nearer, squared, best);
                where = select(nearer, here + T(i), where);
            }
            best.store(lane);
            where.store(index);
            int k = 0;
            for (int i = 1; i < W; ++i) {
                if (lane[i] < lane[k] || (lane[i] == lane[k] && index[i] < index[k])) k = i;
            }
            return static_cast<int>(index[k]);
        }
        static constexpr T far = T(1e15);  // its square is still a number
    };
    // A sample, and where the edge towards it from the node nearest to it ends.
    struct candidate {
        std::vector<T> sample, end;
        int from = 0;
        bool free = true;  // as far as is known
    };

    // Joints count by their levers, as shares of their root mean square; a metre is a radian on that one. Where there
    // are slides alone, what they move in all is a whole turn, in the root mean square: they have no other measure.
    void measure_joints() {
        std::vector<T> most(n_);
        for (int d = 0; d < n_; ++d) most[d] = std::max(std::abs(p_.lower[d]), std::abs(p_.upper[d]));
        const std::vector<T> lever = levers(p_.scene, most);
        T mean = 0, moved = 0;
        for (int d = 0; d < n_; ++d) {
            const T all = lever[d] * (p_.upper[d] - p_.lower[d]);
            mean += lever[d] * lever[d] / T(n_);
            moved += all * all / T(n_);
        }
        mean = std::sqrt(mean);
        moved = std::sqrt(moved);
        if (!(mean > T(0) && mean < std::numeric_limits<T>::max())) return;  // no bodies, or numbers too large
        const auto& joints = p_.scene.robot.joints;
        const bool slides = std::all_of(joints.begin(), joints.end(),
                                        [](const tree_joint<T>& joint) { return joint.kind == joint_kind::prismatic; })
                            && moved > T(0) && moved < std::numeric_limits<T>::max();
        const T radian = slides ? moved / T(6.283185307179586) : mean;
        for (int d = 0; d < n_; ++d) weight_[d] = std::max(lever[d] / mean, least_weight) * (mean / radian);
        for (const auto& joint : joints) {
            if (joint.kind == joint_kind::prismatic) spread_[joint.dof] = T(settings_.spread) * radian;
        }
    }
    void begin_again() {
        blocked_ = 0;
        from_start_.reset(n_);
        from_goals_.reset(n_);
        from_start_.add(p_.start.data(), -1, weight_);
        for (int g = 0; g < p_.goal_count(); ++g) from_goals_.add(p_.goal(g), -1, weight_);
    }
    void draw(search_sequence<T>& random, const branch& one, int k) {
        candidate& c = candidate_[k];
        c.sample.resize(n_);
        if (random.uniform() < T(settings_.near_line)) {
            const T* goal = p_.goal(random.below(p_.goal_count()));
            const T u = random.uniform(), share = u * u * T(0.5);  // in the tree's own half, most near its end
            for (int d = 0; d < n_; ++d) {
                const T on_line = p_.start[d] + (goal[d] - p_.start[d]) * (&one == &from_start_ ? share : T(1) - share);
                const T away = spread_[d] * (random.uniform() - T(0.5)) * T(3.4641016151377544);  // sqrt(12)
                c.sample[d] = std::clamp(on_line + away, p_.lower[d], p_.upper[d]);
            }
        } else {
            for (int d = 0; d < n_; ++d) c.sample[d] = p_.lower[d] + (p_.upper[d] - p_.lower[d]) * random.uniform();
        }
        c.from = nearest(one, c.sample.data());
        c.end = c.sample;
        step_towards(one.node(c.from), c.end.data(), first_edge * T(settings_.step));
        c.free = true;
    }
    void drop_blocked_ends() {
        T rows[W];
        ends_.resize(n_);
        for (int d = 0; d < n_; ++d) {
            for (int k = 0; k < W; ++k) rows[k] = candidate_[k].end[d];
            ends_[d] = pack<T>::load(rows);
        }
        const free_lanes<T> lanes = checker_.free_configurations(ends_.data());
        for (int k = 0; k < W; ++k) candidate_[k].free = lanes.is_free(k);
    }
    // Adds an edge to tree one, and others beyond it while they are free; then edges to tree two, towards its end. True
    // when the trees met.
    template <class Still> bool extend(branch& one, branch& two, const candidate& c, Still&& still, path<T>& found) {
        at_.assign(one.node(c.from), one.node(c.from) + n_);
        next_ = c.end;
        if (!checker_.edge_free(at_.data(), next_.data())) {
            ++blocked_;
            return false;
        }
        int added = one.add(next_.data(), c.from, weight_);
        for (int more = 0; more < more_edges && still(); ++more) {
            at_ = next_;
            next_ = c.sample;
            step_towards(at_.data(), next_.data(), T(settings_.step));
            if (next_ == at_ || !checker_.edge_free(at_.data(), next_.data())) break;
            added = one.add(next_.data(), added, weight_);
        }
        aim_.assign(one.node(added), one.node(added) + n_);
        int other = nearest(two, aim_.data());
        at_.assign(two.node(other), two.node(other) + n_);
        for (int steps = 0; steps < most_steps && still(); ++steps) {
            next_ = aim_;
            const bool arrives = step_towards(at_.data(), next_.data(), T(settings_.step));
            if ((!arrives && next_ == at_) || !checker_.edge_free(at_.data(), next_.data())) return false;
            if (arrives) {
                join(&one == &from_start_ ? added : other, &one == &from_start_ ? other : added, found);
                return true;
            }
            other = two.add(next_.data(), other, weight_);
            at_ = next_;
        }
        return false;
    }
    int nearest(const branch& tree, const T* q) {
        weighted_.resize(n_);
        for (int d = 0; d < n_; ++d) weighted_[d] = weight_[d] * q[d];
        return tree.nearest(weighted_.data());
    }
    T weighted_distance(const T* a, const T* b) const {
        T sum = 0;
        for (int d = 0; d < n_; ++d) {
            const T away = weight_[d] * (a[d] - b[d]);
            sum += away * away;
        }
        return std::sqrt(sum);
    }
    // Pulls `to` within a step of `from`; whether it was within one already.
    bool step_towards(const T* from, T* to, T step) const {
        const T away = weighted_distance(from, to);
        if (away <= step) return true;
        for (int d = 0; d < n_; ++d) to[d] = from[d] + (to[d] - from[d]) * (step / away);
        return false;
    }
    void join(int at_start, int at_goal, path<T>& found) const {
        std::vector<int> order;
        for (int i = at_start; i >= 0; i = from_start_.parent[i]) order.push_back(i);
        found.points.clear();
        const auto add = [&](const T* q) { found.points.insert(found.points.end(), q, q + n_); };
        for (auto i = order.rbegin(); i != order.rend(); ++i) add(from_start_.node(*i));
        for (int i = at_goal; i >= 0; i = from_goals_.parent[i]) {
            add(from_goals_.node(i));
            found.goal = i;  // the goals are the first nodes, and have no parent
        }
    }

    motion_checker<T>& checker_;
    const motion_problem<T>& p_;
    rrt_connect_settings settings_;
    int n_;
    std::vector<T> weight_, spread_;  // (n,) of the joints
    branch from_start_, from_goals_;
    int blocked_ = 0;  // edges, since the trees began
    candidate candidate_[W];
    std::vector<pack<T>> ends_;
    std::vector<T> at_, next_, aim_, weighted_;
};

}  // namespace SPACEARM_NAMESPACE
