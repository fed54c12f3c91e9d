// Nearest neighbours for VAMP in place of its k-d tree, which is fetched from a network at build time: a scan over all
// nodes, sixteen at a time. For trees of a few thousand nodes that is as quick as a tree.
#pragma once

#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

namespace unc::robotics::nigh {

namespace metric {
template <int p> struct LP {};
template <class T, class Metric> struct Space;
}  // namespace metric

struct NoThreadSafety {};
template <std::size_t batch> struct KDTreeBatch {};

template <class Node, class Space, class Key, class Safety, class Strategy> class Nigh {
    static constexpr std::size_t lanes = 16, dimension = Space::kDimensions;

  public:
    std::size_t size() const { return nodes_.size(); }
    void clear() {
        nodes_.clear();
        blocks_.clear();
    }
    void insert(const Node& node) {
        const std::size_t at = nodes_.size() % lanes;
        if (at == 0) blocks_.resize(blocks_.size() + lanes * dimension, 1e18f);
        float* block = &blocks_[nodes_.size() / lanes * lanes * dimension];
        for (std::size_t d = 0; d < dimension; ++d) block[d * lanes + at] = Space::coeff(Key()(node), d);
        nodes_.push_back(node);
    }
    template <class Point> std::optional<std::pair<Node, float>> nearest(const Point& q) const {
        float least = 1e30f;
        std::size_t found = nodes_.size();
        for (std::size_t first = 0; first < nodes_.size(); first += lanes) {
            const float* block = &blocks_[first * dimension];
            float squared[lanes] = {};
            for (std::size_t d = 0; d < dimension; ++d) {
                const float x = Space::coeff(q, d);
                for (std::size_t i = 0; i < lanes; ++i) squared[i] += (block[d * lanes + i] - x) * (block[d * lanes + i] - x);
            }
            for (std::size_t i = 0; i < lanes; ++i) {
                if (squared[i] < least) {
                    least = squared[i];
                    found = first + i;
                }
            }
        }
        if (found >= nodes_.size()) return std::nullopt;
        return std::pair<Node, float>(nodes_[found], std::sqrt(least));
    }

  private:
    std::vector<Node> nodes_;
    std::vector<float> blocks_;
};

}  // namespace unc::robotics::nigh
