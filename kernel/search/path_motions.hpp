// Motions along paths: a path has corners and no timing, a motion is a spline of control points.
//
// `nearest_to` fits a spline with a given number of control points to a path, `with_interior` to another motion.
#pragma once

#include "search/rrt_connect.hpp"

namespace SPACEARM_NAMESPACE {

template <class T> class path_motions {
  public:
    explicit path_motions(motion_checker<T>& checker) : checker_(checker), p_(checker.problem()) {}

    // The motion with K control points that is nearest to a path, which it runs along at rest at both ends.
    motion<T> nearest_to(const path<T>& along_path, int K) {
        const int n = p_.dofs(), samples = 2 * lanes_of<T>, corners = along_path.count(n);
        const spline_table<T>& t = checker_.table(K);
        std::vector<T> along(corners, T(0)), target(static_cast<std::size_t>(samples) * n);
        for (int i = 1; i < corners; ++i)
            along[i] = along[i - 1] + distance_between(&along_path.points[(i - 1) * n], &along_path.points[i * n], n);
        for (int i = 0, k = 0; i < samples; ++i) {
            const T at = t.path_share[i] * along.back();
            while (k + 2 < corners && along[k + 1] < at) ++k;
            const T share = (at - along[k]) / std::max(along[k + 1] - along[k], std::numeric_limits<T>::min());
            for (int d = 0; d < n; ++d) {
                const T q = along_path.points[k * n + d]
                            + (along_path.points[(k + 1) * n + d] - along_path.points[k * n + d]) * share;
                target[static_cast<std::size_t>(i) * n + d] =
                    q - t.end_value[0][i] * p_.start[d] - t.end_value[1][i] * p_.goal(along_path.goal)[d];
            }
        }
        return fitted(t, along_path.goal, target);
    }
    // A motion with fewer or more control points, as near to a given one as can be.
    motion<T> with_interior(const motion<T>& m, int K) {
        const int n = p_.dofs(), samples = 2 * lanes_of<T>, from = m.interior;
        const spline_table<T>&own = checker_.table(from), &t = checker_.table(K);
        std::vector<T> target(static_cast<std::size_t>(samples) * n);
        for (int i = 0; i < samples; ++i) {
            const T* b = &own.at_path[static_cast<std::size_t>(i) * (from + 2)];
            for (int d = 0; d < n; ++d) {
                T q = (b[0] - t.end_value[0][i]) * p_.start[d] + (b[from + 1] - t.end_value[1][i]) * p_.end(m)[d];
                for (int k = 0; k < from; ++k) q += b[k + 1] * m.points[k * n + d];
                target[static_cast<std::size_t>(i) * n + d] = q;
            }
        }
        motion<T> out = fitted(t, m.goal, target);
        out.end = m.end;
        return out;
    }

  private:
    motion<T> fitted(const spline_table<T>& t, int goal, const std::vector<T>& target) const {
        const int n = p_.dofs(), samples = 2 * lanes_of<T>, K = t.interior;
        motion<T> m{K, goal, std::vector<T>(static_cast<std::size_t>(K) * n)};
        for (int k = 0; k < K; ++k) {
            for (int d = 0; d < n; ++d) {
                T sum = 0;
                for (int i = 0; i < samples; ++i)
                    sum += t.nearest[static_cast<std::size_t>(k) * samples + i]
                           * target[static_cast<std::size_t>(i) * n + d];
                m.points[k * n + d] = std::clamp(sum, p_.lower[d], p_.upper[d]);
            }
        }
        return m;
    }

    motion_checker<T>& checker_;
    const motion_problem<T>& p_;
};

}  // namespace SPACEARM_NAMESPACE
