// RRT-Connect (Kuffner and LaValle, 2000): two trees of straight edges, one from the start and one from the goals,
// grown towards each other.
//
// Its paths have corners and no timing; they only tell the search where motions may be. The lanes are instants along
// one edge.
#pragma once

#include "lanes/random.hpp"
#include "motion/checker.hpp"

namespace SPACEARM_NAMESPACE {

template <class T> class path {
  public:
    std::vector<T> points;  // (m, n)
    int goal = 0;
    int count(int n) const { return static_cast<int>(points.size()) / n; }
};

template <class T> T distance_between(const T* a, const T* b, int n) {
    T sum = 0;
    for (int d = 0; d < n; ++d) sum += (a[d] - b[d]) * (a[d] - b[d]);
    return std::sqrt(sum);
}

struct rrt_connect_settings {
    double step = 1.0;       // [rad or m] longest edge of an arm of seven joints; with more it is shorter
    double near_line = 0.8;  // share of the samples drawn around the straight motion ...
    double spread = 2.0;     // ... with this deviation [rad or m]
};

template <class T> class rrt_connect {
  public:
    rrt_connect(motion_checker<T>& checker, const rrt_connect_settings& settings)
        : checker_(checker), p_(checker.problem()), settings_(settings), n_(p_.dofs()),
          step_(T(settings.step) * std::min(T(1), T(7) / T(n_))) {
        begin_again();
    }

    // Grows the trees by at most `samples` more; true when they met. go_on() is asked before every sample, still()
    // before every step. Where numbers are so large that a step goes nowhere, or limits so wide that steps do not
    // arrive, it ends all the same.
    template <class GoOn, class Still>
    bool grow(int samples, search_sequence<T>& random, GoOn&& go_on, Still&& still, path<T>& found) {
        std::vector<T> q(n_), at(n_), next(n_);
        for (int i = 0; i < samples; ++i) {
            if (!go_on()) return false;
            if (std::max(from_start_.count(), from_goals_.count()) >= most_nodes) begin_again();
            branch& one =
                from_start_.count() <= from_goals_.count() ? from_start_ : from_goals_;  // the smaller one grows
            branch& two = &one == &from_start_ ? from_goals_ : from_start_;
            draw(random, q.data());
            const int nearest = one.nearest(q.data());
            one.copy(nearest, at.data());
            step_towards(at.data(), q.data());
            if (!checker_.edge_free(at.data(), q.data())) continue;
            const int added = one.add(q.data(), nearest);
            int other = two.nearest(q.data());
            two.copy(other, at.data());
            for (int steps = 0; steps < most_steps; ++steps) {
                if (!still()) return false;
                next = q;
                const bool arrives = step_towards(at.data(), next.data());
                if (!arrives && next == at) break;
                if (!checker_.edge_free(at.data(), next.data())) break;
                if (arrives) {
                    join(&one == &from_start_ ? added : other, &one == &from_start_ ? other : added, found);
                    begin_again();
                    return true;
                }
                other = two.add(next.data(), other);
                at = next;
            }
        }
        return false;
    }

    // Leaves out what can be left out, from either end, as long as still() says yes.
    template <class Still> void shorten(path<T>& found, Still&& still) {
        for (int i = 0; i + 2 < found.count(n_); ++i) {
            for (int k = found.count(n_) - 1; k >= i + 2; --k) {
                if (!still()) return;
                if (!straight_free(&found.points[i * n_], &found.points[k * n_])) continue;
                found.points.erase(found.points.begin() + (i + 1) * n_, found.points.begin() + k * n_);
                break;
            }
        }
    }
    T length(const path<T>& found) const {
        T sum = 0;
        for (int i = 0; i + 1 < found.count(n_); ++i)
            sum += distance_between(&found.points[i * n_], &found.points[(i + 1) * n_], n_);
        return sum;
    }

    // Whether the way straight from a to b is free, looked at in edges of at most a step.
    bool straight_free(const T* a, const T* b) {
        std::vector<T> from(a, a + n_), to(n_);
        const int parts = std::max(1, static_cast<int>(std::ceil(distance_between(a, b, n_) / step_)));
        for (int i = 1; i <= parts; ++i) {
            for (int d = 0; d < n_; ++d) to[d] = a[d] + (b[d] - a[d]) * T(i) / T(parts);
            if (!checker_.edge_free(from.data(), to.data())) return false;
            from = to;
        }
        return true;
    }

  private:
    static constexpr int most_nodes =
        1 << 18;  // of a tree; beyond, looking for the nearest takes longer than beginning again
    static constexpr int most_steps = 1 << 12;  // towards one sample: many times any arm's range

    // A tree's nodes, one row a joint, so that the nearest is looked for a pack at a time.
    struct branch {
        int n = 0;
        std::vector<std::vector<T>> rows;
        std::vector<int> parent;

        void reset(int dofs) {
            n = dofs;
            rows.assign(n, std::vector<T>(lanes_of<T>, far));
            parent.clear();
        }
        int count() const { return static_cast<int>(parent.size()); }
        int add(const T* q, int from) {
            const int at = count();
            for (int d = 0; d < n; ++d) {
                if (at == static_cast<int>(rows[d].size())) rows[d].resize(2 * rows[d].size(), far);
                rows[d][at] = q[d];
            }
            parent.push_back(from);
            return at;
        }
        void copy(int i, T* q) const {
            for (int d = 0; d < n; ++d) q[d] = rows[d][i];
        }
        int nearest(const T* q) const {
            constexpr int W = lanes_of<T>;
            pack<T> best(std::numeric_limits<T>::max()), where(T(0)), here;
            T lane[W], index[W];
            for (int i = 0; i < W; ++i) lane[i] = T(i);
            here = pack<T>::load(lane);
            for (int i = 0; i < count(); i += W) {
                pack<T> squared(T(0));
                for (int d = 0; d < n; ++d) {
                    const pack<T> away = pack<T>::load(&rows[d][i]) - q[d];
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

    void begin_again() {
        from_start_.reset(n_);
        from_goals_.reset(n_);
        from_start_.add(p_.start.data(), -1);
        for (int g = 0; g < p_.goal_count(); ++g) from_goals_.add(p_.goal(g), -1);
    }
    void draw(search_sequence<T>& random, T* q) {
        if (random.uniform() < T(settings_.near_line)) {
            const T* goal = p_.goal(random.below(p_.goal_count()));
            const T share = random.uniform();
            for (int d = 0; d < n_; ++d) {
                const T on_line = p_.start[d] + (goal[d] - p_.start[d]) * share;
                q[d] = std::clamp(on_line + T(settings_.spread) * random.bell(), p_.lower[d], p_.upper[d]);
            }
            return;
        }
        for (int d = 0; d < n_; ++d) q[d] = p_.lower[d] + (p_.upper[d] - p_.lower[d]) * random.uniform();
    }
    // Pulls `to` within a step of `from`; whether it was within one already.
    bool step_towards(const T* from, T* to) const {
        const T away = distance_between(from, to, n_);
        if (away <= step_) return true;
        for (int d = 0; d < n_; ++d) to[d] = from[d] + (to[d] - from[d]) * (step_ / away);
        return false;
    }
    void join(int at_start, int at_goal, path<T>& found) const {
        std::vector<int> order;
        for (int i = at_start; i >= 0; i = from_start_.parent[i]) order.push_back(i);
        found.points.clear();
        std::vector<T> q(n_);
        for (auto i = order.rbegin(); i != order.rend(); ++i) {
            from_start_.copy(*i, q.data());
            found.points.insert(found.points.end(), q.begin(), q.end());
        }
        for (int i = at_goal; i >= 0; i = from_goals_.parent[i]) {
            from_goals_.copy(i, q.data());
            found.points.insert(found.points.end(), q.begin(), q.end());
            found.goal = i;  // the goals are the first nodes, and have no parent
        }
    }

    motion_checker<T>& checker_;
    const motion_problem<T>& p_;
    rrt_connect_settings settings_;
    int n_;
    T step_;
    branch from_start_, from_goals_;
};

}  // namespace SPACEARM_NAMESPACE
