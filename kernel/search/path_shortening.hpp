// Two ways to shorten a path of straight edges: pruning, and random shortcuts.
//
// `prune` leaves out points of the path, without chance, and is quick: it is done to every path. A shortcut goes
// between any two positions on the path. All joints go straight there, or only some of them while the others stay as
// they were: partial shortcuts (Geraerts and Overmars, Creating High-quality Paths for Motion Planning, 2007). A
// shortcut of all joints is blocked if one of them is in the way; a partial one often is not. That counts most for many
// joints.
#pragma once

#include "search/rrt_connect.hpp"

namespace SPACEARM_NAMESPACE {

template <class T> class path_shortener {
  public:
    path_shortener(rrt_connect<T>& edges, int dofs) : edges_(edges), n_(dofs), only_(dofs) {}

    // Leaves out the points between two others with a free straight edge between them: from the first point on, with
    // the farthest such point. still() is asked before every edge.
    template <class Still> void prune(path<T>& p, Still&& still) {
        for (int i = 0; i + 2 < p.count(n_); ++i) {
            for (int k = p.count(n_) - 1; k >= i + 2; --k) {
                if (!still()) return;
                if (!edges_.straight_free(&p.points[i * n_], &p.points[k * n_])) continue;
                p.points.erase(p.points.begin() + (i + 1) * n_, p.points.begin() + k * n_);
                break;
            }
        }
    }

    // At most `tries` shortcuts; ends after as many failures in a row as `stall`, or when still() says no. Whether the
    // path became shorter.
    template <class Still> bool shorten(path<T>& p, int tries, int stall, search_sequence<T>& random, Still&& still) {
        const T before = measure(p);
        int failures = 0;
        for (int i = 0; i < tries && failures < stall && still(); ++i) {
            if (p.count(n_) < 3) break;
            failures = shortcut(p, random) ? 0 : failures + 1;
        }
        return measure(p) < before;
    }

  private:
    static constexpr T worthwhile = T(0.999);   // a shortcut's length, as a share of what it replaces, at most
    static constexpr T widest_share = T(0.98);  // of the path, that a shortcut replaces

    // Arc lengths up to each point, and the whole.
    T measure(const path<T>& p) {
        const int count = p.count(n_);
        along_.assign(count, T(0));
        for (int i = 1; i < count; ++i)
            along_[i] = along_[i - 1] + distance_between(&p.points[(i - 1) * n_], &p.points[i * n_], n_);
        return along_.back();
    }
    int segment_at(T s) const {
        const auto above = std::upper_bound(along_.begin() + 1, along_.end() - 1, s);
        return static_cast<int>(above - along_.begin()) - 1;
    }
    void point_at(const path<T>& p, T s, int k, T* q) const {
        const T share = std::clamp((s - along_[k]) / std::max(along_[k + 1] - along_[k], std::numeric_limits<T>::min()),
                                   T(0), T(1));
        for (int d = 0; d < n_; ++d) {
            const T a = p.points[k * n_ + d];
            q[d] = a + (p.points[(k + 1) * n_ + d] - a) * share;
        }
    }
    // Tries one shortcut between two random positions; whether it is free and shorter, and was taken.
    bool shortcut(path<T>& p, search_sequence<T>& random) {
        const T all = along_.back(), u = random.uniform(), width = all * u * (T(2) - u) * widest_share;
        const T from = (all - width) * random.uniform(), to = from + width;
        const int first = segment_at(from), last = segment_at(to);
        const bool partial = choose_joints(random);
        if (last == first) return false;
        const int count = lay_shortcut(p, from, width, partial);
        T length = 0;
        for (int i = 0; i + 1 < count; ++i) length += distance_between(&fresh_[i * n_], &fresh_[(i + 1) * n_], n_);
        if (!(length < worthwhile * width)) return false;
        for (int i = 0; i + 1 < count; ++i) {
            if (!edges_.straight_free(&fresh_[i * n_], &fresh_[(i + 1) * n_])) return false;
        }
        // Points first + 1 to last make room for the new ones; ends that are corners already are not doubled.
        auto begin = fresh_.begin(), end = fresh_.end();
        if (from <= along_[first]) begin += n_;
        if (to >= along_[last + 1]) end -= n_;
        const auto at = p.points.erase(p.points.begin() + (first + 1) * n_, p.points.begin() + (last + 1) * n_);
        p.points.insert(at, begin, end);
        measure(p);
        return true;
    }
    // Which joints a shortcut straightens: all, or one, or one and about half of the others. Whether only some.
    bool choose_joints(search_sequence<T>& random) {
        const bool partial = random.uniform() < T(0.5);
        const int one = random.below(n_);
        const bool several = random.uniform() < T(0.5);
        for (int d = 0; d < n_; ++d) only_[d] = !partial || d == one || (several && random.uniform() < T(0.5));
        return partial;
    }
    // Puts the shortcut's points into fresh_: its ends, and of a partial one those of the path between them. How many.
    int lay_shortcut(const path<T>& p, T from, T width, bool partial) {
        const T to = from + width;
        const int first = segment_at(from), last = segment_at(to), count = partial ? last - first + 2 : 2;
        fresh_.assign(static_cast<std::size_t>(n_) * count, T(0));
        T* b = fresh_.data() + fresh_.size() - n_;
        point_at(p, from, first, fresh_.data());
        point_at(p, to, last, b);
        for (int i = 1; i + 1 < count; ++i) {
            const int k = first + i;
            const T share = (along_[k] - from) / width;
            for (int d = 0; d < n_; ++d)
                fresh_[i * n_ + d] = only_[d] ? fresh_[d] + (b[d] - fresh_[d]) * share : p.points[k * n_ + d];
        }
        return count;
    }

    rrt_connect<T>& edges_;
    int n_;
    std::vector<char> only_;        // (n,) the joints that the shortcut straightens
    std::vector<T> along_, fresh_;  // the path's lengths up to its points; the shortcut's points
};

}  // namespace SPACEARM_NAMESPACE
