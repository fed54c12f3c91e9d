// Obstacles of every shape in one set, with a tree of boxes along the axes: what is far away costs one comparison.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "geometry/distance.hpp"

namespace SPACEARM_NAMESPACE {

enum class shape : std::uint8_t { none, sphere, capsule, box, cylinder, half_space };

template <class T> struct obstacle_node {
    T lower[3], upper[3];
    int skip;    // the next node when this one is passed over
    shape kind;  // none: an inner node
    int index;   // into the shape's list
};

template <class T> struct obstacle_set {
    std::vector<sphere<T>> spheres;
    std::vector<capsule_obstacle<T>> capsules;
    std::vector<box_obstacle<T>> boxes;
    std::vector<cylinder_obstacle<T>> cylinders;
    std::vector<half_space_obstacle<T>> half_spaces;
    std::vector<obstacle_node<T>> tree;

    // Calls use(shape) with the shape that a node stands for.
    template <class Use> SPACEARM_INLINE auto visit(shape kind, int index, Use&& use) const {
        switch (kind) {
            case shape::sphere: return use(spheres[index]);
            case shape::capsule: return use(capsules[index]);
            case shape::box: return use(boxes[index]);
            case shape::cylinder: return use(cylinders[index]);
            default: return use(half_spaces[index]);
        }
    }
    std::size_t count(shape kind) const {
        const std::size_t sizes[] = {
            0, spheres.size(), capsules.size(), boxes.size(), cylinders.size(), half_spaces.size()};
        return sizes[static_cast<int>(kind)];
    }
    void build_tree();
};

// ---- boxes around the shapes ----------------------------------------------------------------------------------------
template <class T> struct bounds3 {
    T lower[3], upper[3];
    void around(const T* center, const T* half) {
        for (int k = 0; k < 3; ++k) {
            lower[k] = center[k] - half[k];
            upper[k] = center[k] + half[k];
        }
    }
    void join(const bounds3& o) {
        for (int k = 0; k < 3; ++k) {
            lower[k] = std::min(lower[k], o.lower[k]);
            upper[k] = std::max(upper[k], o.upper[k]);
        }
    }
};
template <class T> bounds3<T> bounds_of(const sphere<T>& o) {
    const T half[3] = {o.radius, o.radius, o.radius};
    bounds3<T> out;
    out.around(o.center, half);
    return out;
}
template <class T> bounds3<T> bounds_of(const capsule_obstacle<T>& o) {
    bounds3<T> out;
    for (int k = 0; k < 3; ++k) {
        out.lower[k] = o.a[k] + std::min(o.ab[k], T(0)) - o.radius;
        out.upper[k] = o.a[k] + std::max(o.ab[k], T(0)) + o.radius;
    }
    return out;
}
template <class T> bounds3<T> bounds_of(const box_obstacle<T>& o) {
    T half[3];
    for (int k = 0; k < 3; ++k)
        half[k] = std::abs(o.axis[0][k]) * o.half[0] + std::abs(o.axis[1][k]) * o.half[1]
                  + std::abs(o.axis[2][k]) * o.half[2];
    bounds3<T> out;
    out.around(o.center, half);
    return out;
}
template <class T> bounds3<T> bounds_of(const cylinder_obstacle<T>& o) {
    const auto across = [](T a, T b) { return std::sqrt(a * a + b * b); };
    T half[3];
    for (int k = 0; k < 3; ++k)
        half[k] = std::abs(o.axis[k]) * o.half_length + across(o.axis[(k + 1) % 3], o.axis[(k + 2) % 3]) * o.radius;
    bounds3<T> out;
    out.around(o.center, half);
    return out;
}
template <class T> bounds3<T> bounds_of(const half_space_obstacle<T>&) {
    const T most = std::numeric_limits<T>::max() / 4;
    return {{-most, -most, -most}, {most, most, most}};
}

// A binary tree, split at the median along the longest side; few obstacles are a plain list.
template <class T> void obstacle_set<T>::build_tree() {
    struct leaf {
        bounds3<T> box;
        shape kind;
        int index;
    };
    std::vector<leaf> leaves;
    const auto add = [&](const auto& shapes, shape kind) {
        for (std::size_t i = 0; i < shapes.size(); ++i)
            leaves.push_back({bounds_of(shapes[i]), kind, static_cast<int>(i)});
    };
    add(half_spaces, shape::half_space);
    const std::size_t finite_from = leaves.size();
    add(boxes, shape::box);
    add(cylinders, shape::cylinder);
    add(capsules, shape::capsule);
    add(spheres, shape::sphere);
    tree.clear();
    const auto push = [&](const bounds3<T>& b, shape kind, int index) {
        obstacle_node<T> node{};
        for (int k = 0; k < 3; ++k) {  // a little larger, for the rounding here and where it is asked
            const T slack = T(8 * std::numeric_limits<T>::epsilon()) * (std::abs(b.lower[k]) + std::abs(b.upper[k]));
            node.lower[k] = b.lower[k] - slack;
            node.upper[k] = b.upper[k] + slack;
        }
        node.kind = kind;
        node.index = index;
        node.skip = static_cast<int>(tree.size()) + 1;
        tree.push_back(node);
    };
    for (std::size_t i = 0; i < finite_from; ++i) push(leaves[i].box, leaves[i].kind, leaves[i].index);
    constexpr std::size_t plain_list = 6;
    const auto split = [&](auto&& self, std::size_t begin, std::size_t end) -> void {
        if (begin == end) return;
        if (end - begin == 1) return push(leaves[begin].box, leaves[begin].kind, leaves[begin].index);
        bounds3<T> all = leaves[begin].box, middles = all;
        for (int k = 0; k < 3; ++k) middles.lower[k] = middles.upper[k] = (all.lower[k] + all.upper[k]) / 2;
        for (std::size_t i = begin + 1; i < end; ++i) {
            all.join(leaves[i].box);
            for (int k = 0; k < 3; ++k) {
                const T c = (leaves[i].box.lower[k] + leaves[i].box.upper[k]) / 2;
                middles.lower[k] = std::min(middles.lower[k], c);
                middles.upper[k] = std::max(middles.upper[k], c);
            }
        }
        const std::size_t at = tree.size();
        const bool inner = end - begin > plain_list;
        if (!inner) {
            for (std::size_t i = begin; i < end; ++i) push(leaves[i].box, leaves[i].kind, leaves[i].index);
            return;
        }
        push(all, shape::none, 0);
        int longest = 0;
        for (int k = 1; k < 3; ++k) {
            if (middles.upper[k] - middles.lower[k] > middles.upper[longest] - middles.lower[longest]) longest = k;
        }
        const std::size_t middle = (begin + end) / 2;
        std::nth_element(
            leaves.begin() + begin, leaves.begin() + middle, leaves.begin() + end, [&](const leaf& x, const leaf& y) {
                return x.box.lower[longest] + x.box.upper[longest] < y.box.lower[longest] + y.box.upper[longest];
            });
        self(self, begin, middle);
        self(self, middle, end);
        tree[at].skip = static_cast<int>(tree.size());
    };
    split(split, finite_from, leaves.size());
}

template <class T> SPACEARM_INLINE bool near_box(const vec3<T>& p, T reach, const obstacle_node<T>& n) {
    const pack_mask<T> x = (p.x <= n.lower[0] - reach) | (pack<T>(n.upper[0] + reach) <= p.x);
    const pack_mask<T> y = (p.y <= n.lower[1] - reach) | (pack<T>(n.upper[1] + reach) <= p.y);
    const pack_mask<T> z = (p.z <= n.lower[2] - reach) | (pack<T>(n.upper[2] + reach) <= p.z);
    return !all(x | y | z);
}

}  // namespace SPACEARM_NAMESPACE
