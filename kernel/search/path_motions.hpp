// Motions along paths: a path has corners and no timing, a motion is a spline of control points.
//
// `nearest_to` fits a spline with a given number of control points to a path, `with_interior` to another motion; both
// in the least-squares sense. `blend_corners` lays control points along the path. Where six neighbouring ones lie on
// one edge, the motion runs on that edge, so it leaves the path only at corners, which it rounds. A corner at which the
// motion collides gets more and nearer control points, until the motion is free: five in one place are the corner
// itself. So a path whose edges are free becomes a motion, always.
#pragma once

#include "search/rrt_connect.hpp"

namespace SPACEARM_NAMESPACE {

inline constexpr int most_interior = 512;  // control points

enum class blend_outcome : std::uint8_t {
    free,        // the motion is
    blocked,     // the path itself is not: `edge` and the configuration `at` on it
    unmet,       // it is, but something else is asked of motions: an order of near pairs, a duration
    unfinished,  // told to stop, or more control points than there may be
};
template <class T> struct blended_path {
    blend_outcome outcome = blend_outcome::unfinished;
    motion<T> found;
    int edge = -1;      // from the path's point of this number to the next
    std::vector<T> at;  // (n,)
    int looks = 0;      // at motions
};

template <class T> class path_motions {
  public:
    explicit path_motions(motion_checker<T>& checker) : checker_(checker), p_(checker.problem()), n_(p_.dofs()) {}

    // The motion with K control points that is nearest to a path, which it runs along at rest at both ends.
    motion<T> nearest_to(const path<T>& along_path, int K) {
        walker on(along_path, n_);
        if (K > most_tabled) {
            return fitted_anywhere(along_path.goal, p_.goal(along_path.goal), K, 4 * (K + 1),
                                   [&](double s, T* q) { on.at(static_cast<T>(eased(s)), q); });
        }
        const int samples = 2 * lanes_of<T>;
        const fit_table<T>& t = table(K);
        std::vector<T> target(static_cast<std::size_t>(samples) * n_);
        for (int i = 0; i < samples; ++i) {
            T* q = &target[static_cast<std::size_t>(i) * n_];
            on.at(t.path_share[i], q);
            for (int d = 0; d < n_; ++d)
                q[d] = q[d] - t.end_value[0][i] * p_.start[d] - t.end_value[1][i] * p_.goal(along_path.goal)[d];
        }
        return fitted(t, along_path.goal, target);
    }
    // A motion with fewer or more control points, as near to a given one as can be.
    motion<T> with_interior(const motion<T>& m, int K) {
        const int samples = 2 * lanes_of<T>, from = m.interior;
        motion<T> out;
        if (std::max(from, K) > most_tabled) {
            out = fitted_anywhere(m.goal, p_.end(m), K, 4 * (std::max(from, K) + 1),
                                  [&](double s, T* q) { place(m, s, q); });
        } else {
            const fit_table<T>&own = table(from), &t = table(K);
            std::vector<T> target(static_cast<std::size_t>(samples) * n_);
            for (int i = 0; i < samples; ++i) {
                const T* b = &own.at_path[static_cast<std::size_t>(i) * (from + 2)];
                for (int d = 0; d < n_; ++d) {
                    T q = (b[0] - t.end_value[0][i]) * p_.start[d] + (b[from + 1] - t.end_value[1][i]) * p_.end(m)[d];
                    for (int k = 0; k < from; ++k) q += b[k + 1] * m.points[k * n_ + d];
                    target[static_cast<std::size_t>(i) * n_ + d] = q;
                }
            }
            out = fitted(t, m.goal, target);
        }
        out.end = m.end;
        return out;
    }

    // A motion along a path with rounded corners, free if the path is; go_on() is asked before every look.
    template <class GoOn> blended_path<T> blend_corners(const path<T>& along_path, GoOn&& go_on) {
        blended_path<T> out;
        const int edges = along_path.count(n_) - 1;
        std::vector<int> tightness(edges + 1, 0);  // which of `blends` each corner has
        std::vector<control_place> places;
        std::vector<double> where;
        while (go_on()) {
            place_along(along_path, tightness, places);
            if (static_cast<int>(places.size()) > most_interior) return out;
            place_controls(along_path, places, out.found);
            ++out.looks;
            const bool free = checker_.free(out.found, where);
            if (where.empty()) {
                out.outcome = free ? blend_outcome::free : blend_outcome::unmet;
                return out;
            }
            if (!tighten_corners(places, where, edges, tightness, out)) {
                out.outcome = blend_outcome::blocked;
                return out;
            }
        }
        return out;
    }

  private:
    // Where a path is at a share of its length; the shares asked for rise.
    class walker {
      public:
        walker(const path<T>& of, int n) : points_(of.points), n_(n), along_(of.count(n), T(0)) {
            for (std::size_t i = 1; i < along_.size(); ++i)
                along_[i] = along_[i - 1] + distance_between(&points_[(i - 1) * n], &points_[i * n], n);
        }
        void at(T share_of_all, T* q) {
            const T at = share_of_all * along_.back();
            while (k_ + 2 < along_.size() && along_[k_ + 1] < at) ++k_;
            const T share = (at - along_[k_]) / std::max(along_[k_ + 1] - along_[k_], std::numeric_limits<T>::min());
            for (int d = 0; d < n_; ++d)
                q[d] = points_[k_ * n_ + d] + (points_[(k_ + 1) * n_ + d] - points_[k_ * n_ + d]) * share;
        }

      private:
        const std::vector<T>& points_;
        int n_;
        std::vector<T> along_;
        std::size_t k_ = 0;
    };
    static double eased(double s) { return s * s * s * (10 - 15 * s + 6 * s * s); }

    const fit_table<T>& table(int K) {
        if (K >= static_cast<int>(tables_.size())) tables_.resize(K + 1);
        if (!tables_[K]) tables_[K] = fit_table_of<T>(K);
        return *tables_[K];
    }

    // ---- least squares ----------------------------------------------------------------------------------------------
    motion<T> fitted(const fit_table<T>& t, int goal, const std::vector<T>& target) const {
        const int samples = 2 * lanes_of<T>, K = t.interior;
        motion<T> m{K, goal, std::vector<T>(static_cast<std::size_t>(K) * n_)};
        for (int k = 0; k < K; ++k) {
            for (int d = 0; d < n_; ++d) {
                T sum = 0;
                for (int i = 0; i < samples; ++i)
                    sum += t.nearest[static_cast<std::size_t>(k) * samples + i]
                           * target[static_cast<std::size_t>(i) * n_ + d];
                m.points[k * n_ + d] = std::clamp(sum, p_.lower[d], p_.upper[d]);
            }
        }
        return m;
    }
    // The same for any number of control points and samples, `place(s, q)` gives the sample at s. The normal equations
    // have five bands beside the diagonal: Cholesky's decomposition, in double precision.
    template <class Place> motion<T> fitted_anywhere(int goal, const T* end, int K, int samples, Place&& place) const {
        motion<T> m{K, goal, std::vector<T>(static_cast<std::size_t>(K) * n_)};
        std::vector<double> band(static_cast<std::size_t>(K) * 6, 0.0), right(static_cast<std::size_t>(K) * n_, 0.0);
        std::vector<T> q(n_);
        for (int i = 0; i < samples; ++i) {
            const double s = (i + 0.5) / samples;
            const int span = span_of(s * (K + 1), K);
            const std::array<double, 6> b = six_values_at(s * (K + 1), K);
            place(s, q.data());
            for (int j = 0; j < 6; ++j) {  // what the ends contribute is no unknown
                const int k = span + j - 3;
                if (k >= 0 && k < K) continue;
                for (int d = 0; d < n_; ++d) q[d] -= static_cast<T>(b[j]) * (k < 0 ? p_.start[d] : end[d]);
            }
            for (int j = 0; j < 6; ++j) {
                const int k = span + j - 3;
                if (k < 0 || k >= K) continue;
                for (int l = 0; l <= j && k - l >= 0; ++l) band[static_cast<std::size_t>(k) * 6 + l] += b[j] * b[j - l];
                for (int d = 0; d < n_; ++d) right[static_cast<std::size_t>(k) * n_ + d] += b[j] * double(q[d]);
            }
        }
        solve_banded(band, right, K);
        for (int k = 0; k < K; ++k) {
            for (int d = 0; d < n_; ++d) {
                const std::size_t at = static_cast<std::size_t>(k) * n_ + d;
                m.points[at] = std::clamp(static_cast<T>(right[at]), p_.lower[d], p_.upper[d]);
            }
        }
        return m;
    }
    // Row k of `band`: the entries (k, k), (k, k - 1), ... (k, k - 5) of a positive definite matrix.
    void solve_banded(std::vector<double>& band, std::vector<double>& right, int K) const {
        const auto at = [&](int k, int l) -> double& { return band[static_cast<std::size_t>(k) * 6 + (k - l)]; };
        for (int k = 0; k < K; ++k) {
            at(k, k) += 1e-6;  // where a control point does little
            for (int l = std::max(0, k - 5); l <= k; ++l) {
                double sum = at(k, l);
                for (int i = std::max(0, k - 5); i < l; ++i) {
                    if (i >= l - 5) sum -= at(k, i) * at(l, i);
                }
                at(k, l) = l < k ? sum / at(l, l) : std::sqrt(sum);
            }
            for (int d = 0; d < n_; ++d) {
                double sum = right[static_cast<std::size_t>(k) * n_ + d];
                for (int i = std::max(0, k - 5); i < k; ++i)
                    sum -= at(k, i) * right[static_cast<std::size_t>(i) * n_ + d];
                right[static_cast<std::size_t>(k) * n_ + d] = sum / at(k, k);
            }
        }
        for (int k = K - 1; k >= 0; --k) {
            for (int d = 0; d < n_; ++d) {
                double sum = right[static_cast<std::size_t>(k) * n_ + d];
                for (int i = k + 1; i < std::min(K, k + 6); ++i)
                    sum -= at(i, k) * right[static_cast<std::size_t>(i) * n_ + d];
                right[static_cast<std::size_t>(k) * n_ + d] = sum / at(k, k);
            }
        }
    }
    const T* control(const motion<T>& m, int k) const {
        return k <= 0 ? p_.start.data() : k > m.interior ? p_.end(m) : &m.points[static_cast<std::size_t>(k - 1) * n_];
    }
    void place(const motion<T>& m, double s, T* q) const {
        const int span = span_of(s * (m.interior + 1), m.interior);
        const std::array<double, 6> b = six_values_at(s * (m.interior + 1), m.interior);
        std::fill(q, q + n_, T(0));
        for (int j = 0; j < 6; ++j) {
            const T* c = control(m, span + j - 2);
            for (int d = 0; d < n_; ++d) q[d] += static_cast<T>(b[j]) * c[d];
        }
    }

    // ---- along the path ---------------------------------------------------------------------------------------------
    // Where a control point is: on the edge of this number, at a share of it below 1; share 0 is the corner itself.
    struct control_place {
        int edge;
        double share;
        double along() const { return edge + share; }
    };
    // How a motion rounds a corner: so many control points on either side of the one at the corner, at multiples of
    // this share of the edge. The last has all of them in the corner. A motion cuts a corner by about 0.2 of the
    // distance to the nearest control point; a third one to a side has no part in it.
    struct corner_blend {
        int beside;
        double share;
        bool middle;  // whether the edges have a control point in the middle, too
    };
    static constexpr corner_blend blends[] = {{0, 0, false},        {0, 0, true},        {1, 1.0 / 4, true},
                                              {1, 1.0 / 12, true},  {2, 1.0 / 24, true}, {2, 1.0 / 96, true},
                                              {2, 1.0 / 384, true}, {2, 0, true}};
    static constexpr int tightest = static_cast<int>(std::size(blends)) - 1;

    // The interior control points, in order.
    void place_along(const path<T>& along_path, const std::vector<int>& tightness,
                     std::vector<control_place>& places) const {
        places.clear();
        const int edges = along_path.count(n_) - 1;
        for (int e = 0; e < edges; ++e) {
            const corner_blend &from = blends[tightness[e]], &to = blends[tightness[e + 1]];
            if (e > 0) {
                places.push_back({e, 0.0});
                for (int i = 1; i <= from.beside; ++i) places.push_back({e, i * from.share});
            }
            if ((e > 0 && from.middle) || (e + 1 < edges && to.middle)) places.push_back({e, 0.5});
            if (e + 1 == edges) break;
            for (int i = to.beside; i > 0; --i)
                places.push_back(to.share > 0 ? control_place{e, 1 - i * to.share} : control_place{e + 1, 0.0});
        }
    }
    void place_controls(const path<T>& along_path, const std::vector<control_place>& places, motion<T>& m) const {
        m.interior = static_cast<int>(places.size());
        m.goal = along_path.goal;
        m.end.clear();
        m.points.resize(places.size() * n_);
        for (std::size_t k = 0; k < places.size(); ++k) {
            const T* from = &along_path.points[static_cast<std::size_t>(places[k].edge) * n_];
            const T share = static_cast<T>(places[k].share);
            for (int d = 0; d < n_; ++d)
                m.points[k * n_ + d] = share > T(0) ? from[d] + (from[n_ + d] - from[d]) * share : from[d];
        }
    }
    // Tightens the corner that each collision is nearest to; false where one is on the path itself.
    bool tighten_corners(const std::vector<control_place>& places, const std::vector<double>& where, int edges,
                         std::vector<int>& tightness, blended_path<T>& out) const {
        const int K = static_cast<int>(places.size());
        const auto along = [&](int row) {  // of the K + 6 control points
            return row < 3 ? 0.0 : row < K + 3 ? places[row - 3].along() : double(edges);
        };
        const std::vector<int> before = tightness;
        for (double s : where) {
            const double x = s * (K + 1);
            const int span = span_of(x, K);
            const int first = static_cast<int>(std::floor(along(span))) + 1,
                      last = static_cast<int>(std::ceil(along(span + 5))) - 1;
            const std::array<double, 6> b = six_values_at(x, K);
            if (first > last) {
                out.edge = std::min(first - 1, edges - 1);
                out.at.resize(n_);
                place(out.found, s, out.at.data());
                return false;
            }
            double mean = 0;
            for (int j = 0; j < 6; ++j) mean += b[j] * along(span + j);
            const int corner = std::clamp(static_cast<int>(std::lround(mean)), first, last);
            tightness[corner] = std::min(before[corner] + 1, tightest);
        }
        return true;
    }

    motion_checker<T>& checker_;
    const motion_problem<T>& p_;
    int n_;
    std::vector<std::shared_ptr<const fit_table<T>>> tables_;
};

}  // namespace SPACEARM_NAMESPACE
