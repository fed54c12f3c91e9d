// Pairs that are nearer to each other at an end of a motion than what is required of them.
//
// An arm leaves its cradle: it must not come nearer to it than it was, and once it is out, all that is required holds.
// Trees and edges ask such a pair for the least that it has to keep anywhere (its pair margin). A whole motion is asked
// for more, for there the order of the instants is known: before the pair is first as far apart as required it is held
// to what it has at the start, after it was last so to what it has at the goal, and between to what is required.
#pragma once

#include <numeric>

#include "mechanism/world.hpp"

namespace SPACEARM_NAMESPACE {

// Bodies and obstacles of a pair, as they were given; a pair has several rows where a link or an obstacle has parts.
struct near_pair_row {
    int pair = 0, body = 0, obstacle = -1, other = -1;  // other: a body, where the obstacle is -1
};
struct near_pairs_request {
    std::vector<near_pair_row> rows;
    std::vector<double> required, at_start;  // [m] of each pair
    std::vector<double> at_goal;             // [m] (pairs, goals)
};

template <class T> struct near_pair {
    T required = T(0), at_start = T(0);       // [m]
    std::vector<T> at_goal;                   // [m] of each goal
    std::vector<int> clusters;                // with obstacles
    std::vector<char> is_of;                  // whether a node of the obstacles' tree is one of the pair
    std::vector<std::pair<int, int>> of_two;  // clusters with clusters
};

// The clearance of a pair at a pack of instants, or what is required if that is less, with the envelope in place.
template <class T>
SPACEARM_NOINLINE pack<T> clearance_of(const near_pair<T>& pair, const model<T>& m, const frame<T>* frames,
                                       envelope_memory<T>& w) {
    const link_envelope<T>& b = m.envelope;
    pack<T> least(pair.required);
    for (int i : pair.clusters) {
        const cluster<T>& c = b.clusters[i];
        if (c.joint < 0 && !w.base) continue;  // the base and the obstacles stand still
        const int nodes = static_cast<int>(m.obstacles.tree.size());
        for (int k = 0; k < nodes;) {
            const obstacle_node<T>& node = m.obstacles.tree[k];
            if (all(beyond_box(w.centers[i], c.radius + pair.required, node))) {
                k = node.skip;
                continue;
            }
            if (pair.is_of[k]) {
                m.obstacles.visit(node.kind, node.index, [&](const auto& o) {
                    least = min(least, cluster_clearance(b, frames, i, o, pair.required, w));
                });
            }
            ++k;
        }
    }
    for (const auto& [i, j] : pair.of_two)
        least = min(least, cluster_pair_clearance(b, frames, i, j, pair.required, w));
    return least;
}

// The near pairs of a problem, and what a motion has of them.
template <class T> class near_pair_watch {
  public:
    static constexpr int W = lanes_of<T>;

    explicit near_pair_watch(const std::vector<near_pair<T>>& pairs) : pairs_(pairs), clearance_(pairs.size()) {}

    bool any() const { return !pairs_.empty(); }
    void begin() {
        instants_.clear();
        for (auto& row : clearance_) row.clear();
    }
    // At a pack of instants, with the envelope in place.
    template <class Instant>
    void add(const model<T>& m, const frame<T>* frames, envelope_memory<T>& w, Instant&& instant) {
        T lane[W];
        for (std::size_t p = 0; p < pairs_.size(); ++p) {
            clearance_of(pairs_[p], m, frames, w).store(lane);
            clearance_[p].insert(clearance_[p].end(), lane, lane + W);
        }
        for (int i = 0; i < W; ++i) instants_.push_back(instant(i));
    }
    // By how much the instants so far fall short, in the order of the motion; beyond what the pairs' own margins ask
    // for everywhere.
    T shortfall(int goal) {
        order_.resize(instants_.size());
        std::iota(order_.begin(), order_.end(), 0);
        std::stable_sort(order_.begin(), order_.end(), [&](int i, int k) { return instants_[i] < instants_[k]; });
        T sum = 0;
        for (std::size_t p = 0; p < pairs_.size(); ++p) sum += shortfall_of(pairs_[p], clearance_[p], goal);
        return sum;
    }

  private:
    T shortfall_of(const near_pair<T>& pair, const std::vector<T>& clearance, int goal) const {
        const auto far_enough = [&](int i) { return clearance[i] >= pair.required; };
        const auto first = std::find_if(order_.begin(), order_.end(), far_enough);
        const auto last = std::find_if(order_.rbegin(), order_.rend(), far_enough).base();  // one beyond it
        const T at_goal = pair.at_goal[goal], least = std::min(pair.at_start, at_goal);
        T sum = 0;
        for (auto i = order_.begin(); i != order_.end(); ++i) {
            const T held = first == order_.end() ? least
                           : i < first           ? pair.at_start
                           : i < last            ? pair.required
                                                 : at_goal;
            sum += std::max(T(0), held - std::max(clearance[*i], least));
        }
        return sum;
    }

    const std::vector<near_pair<T>>& pairs_;
    std::vector<double> instants_;
    std::vector<std::vector<T>> clearance_;  // of each pair
    std::vector<int> order_;
};

template <class T>
std::vector<near_pair<T>> near_pairs_of(const model<T>& scene, const near_pairs_request& given, std::size_t goals) {
    const std::size_t count = given.required.size();
    const int bodies = static_cast<int>(scene.cluster_of.size()), obstacles = static_cast<int>(scene.node_of.size());
    require(given.at_start.size() == count && given.at_goal.size() == count * goals,
            "the near pairs' arrays do not fit");
    for (const auto* numbers : {&given.required, &given.at_start, &given.at_goal})
        require(all_within(*numbers, widest), "a near pair's clearance that is none, or too large");
    std::vector<near_pair<T>> out(count);
    for (std::size_t p = 0; p < count; ++p) {
        out[p].required = static_cast<T>(given.required[p]);
        // Nowhere is a pair held to more than is required.
        out[p].at_start = std::min(out[p].required, static_cast<T>(given.at_start[p]));
        for (std::size_t g = 0; g < goals; ++g)
            out[p].at_goal.push_back(std::min(out[p].required, static_cast<T>(given.at_goal[p * goals + g])));
        out[p].is_of.assign(scene.obstacles.tree.size(), 0);
    }
    const auto add = [](auto& list, const auto& one) {
        if (std::find(list.begin(), list.end(), one) == list.end()) list.push_back(one);
    };
    for (const auto& [pair, body, obstacle, other] : given.rows) {
        require(pair >= 0 && pair < static_cast<int>(count) && body >= 0 && body < bodies && obstacle < obstacles
                    && other < bodies && (obstacle >= 0 || other >= 0),
                "a near pair is out of range");
        near_pair<T>& of = out[pair];
        if (obstacle < 0) {
            add(of.of_two, std::pair(scene.cluster_of[body], scene.cluster_of[other]));
            continue;
        }
        add(of.clusters, scene.cluster_of[body]);
        of.is_of[scene.node_of[obstacle]] = 1;
    }
    return out;
}

}  // namespace SPACEARM_NAMESPACE
