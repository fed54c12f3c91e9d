// Obstacles of every shape in one set, with a tree of boxes along the axes: what is far away costs one comparison.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "geometry/convex.hpp"

namespace SPACEARM_NAMESPACE {

enum class shape : std::uint8_t { none, sphere, capsule, box, cylinder, half_space, polytope };

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
    std::vector<polytope_obstacle<T>> polytopes;
    std::vector<obstacle_node<T>> tree;

    // Calls use(shape) with the shape that a node stands for.
    template <class Use> SPACEARM_INLINE auto visit(shape kind, int index, Use&& use) const {
        switch (kind) {
            case shape::sphere: return use(spheres[index]);
            case shape::capsule: return use(capsules[index]);
            case shape::box: return use(boxes[index]);
            case shape::cylinder: return use(cylinders[index]);
            case shape::polytope: return use(polytopes[index]);
            default: return use(half_spaces[index]);
        }
    }
    std::size_t count(shape kind) const {
        const std::size_t sizes[] = {
            0, spheres.size(), capsules.size(), boxes.size(), cylinders.size(), half_spaces.size(), polytopes.size()};
        return sizes[static_cast<int>(kind)];
    }
    void build_tree();
};

// ---- building -------------------------------------------------------------------------------------------------------
// A polytope from vertices in the world. Its bounds are a little larger, for the rounding of its vertices.
template <class T>
polytope_obstacle<T> make_polytope_obstacle(const std::vector<std::array<double, 3>>& vertices, double rounding) {
    polytope_obstacle<T> o{};
    double lower[3], upper[3], reach = 0;
    for (int k = 0; k < 3; ++k) {
        lower[k] = upper[k] = vertices.front()[k];
        for (const auto& v : vertices) {
            lower[k] = std::min(lower[k], v[k]);
            upper[k] = std::max(upper[k], v[k]);
        }
        o.center[k] = static_cast<T>((lower[k] + upper[k]) / 2);
    }
    for (const auto& v : vertices) {
        double d[3];
        for (int k = 0; k < 3; ++k) d[k] = v[k] - double(o.center[k]);
        reach = std::max(reach, std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]));
        o.vertices.push_back({static_cast<T>(d[0]), static_cast<T>(d[1]), static_cast<T>(d[2])});
    }
    const double wider = 1 + 4 * double(std::numeric_limits<T>::epsilon());
    o.reach = static_cast<T>(reach * wider);
    for (int k = 0; k < 3; ++k)
        o.half[k] = static_cast<T>(std::max(upper[k] - double(o.center[k]), double(o.center[k]) - lower[k]) * wider);
    o.rounding = static_cast<T>(rounding);
    return o;
}

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
                  + std::abs(o.axis[2][k]) * o.half[2] + o.rounding;
    bounds3<T> out;
    out.around(o.center, half);
    return out;
}
template <class T> bounds3<T> bounds_of(const cylinder_obstacle<T>& o) {
    const auto across = [](T a, T b) { return std::sqrt(a * a + b * b); };
    T half[3];
    for (int k = 0; k < 3; ++k)
        half[k] = std::abs(o.axis[k]) * o.half_length + across(o.axis[(k + 1) % 3], o.axis[(k + 2) % 3]) * o.radius
                  + o.rounding;
    bounds3<T> out;
    out.around(o.center, half);
    return out;
}
template <class T> bounds3<T> bounds_of(const polytope_obstacle<T>& o) {
    const T half[3] = {o.half[0] + o.rounding, o.half[1] + o.rounding, o.half[2] + o.rounding};
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
    add(polytopes, shape::polytope);
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

// ---- obstacles as convex shapes, for signed_distance ----------------------------------------------------------------
// A shape that stands still, with its axes and origin in the world. Vertices are those of the obstacle.
template <class T> struct standing_shape {
    convex_shape<T> shape{};
    T axis[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    T origin[3] = {};

    placed_shape<T> placed() const {
        return {&shape, {constant(axis[0]), constant(axis[1]), constant(axis[2])}, constant(origin)};
    }
    // Any x and y axes that are square to a unit z axis.
    void along(const T* z) {
        int least = 0;
        for (int k = 1; k < 3; ++k) least = std::abs(z[k]) < std::abs(z[least]) ? k : least;
        const T share = z[least], size = std::sqrt(1 - share * share);
        for (int k = 0; k < 3; ++k) {
            axis[0][k] = ((k == least ? T(1) : T(0)) - share * z[k]) / size;
            axis[2][k] = z[k];
        }
        for (int k = 0; k < 3; ++k)
            axis[1][k] = z[(k + 1) % 3] * axis[0][(k + 2) % 3] - z[(k + 2) % 3] * axis[0][(k + 1) % 3];
    }
};
template <class T> standing_shape<T> standing(const sphere<T>& o) {
    standing_shape<T> out;
    out.shape = {core_kind::segment, {}, o.radius, 0, nullptr};
    std::copy_n(o.center, 3, out.origin);
    return out;
}
template <class T> standing_shape<T> standing(const capsule_obstacle<T>& o) {
    standing_shape<T> out;
    const T length = std::sqrt(o.ab[0] * o.ab[0] + o.ab[1] * o.ab[1] + o.ab[2] * o.ab[2]);
    out.shape = {core_kind::segment, {T(0), T(0), length / 2}, o.radius, 0, nullptr};
    for (int k = 0; k < 3; ++k) {
        if (length > T(0)) out.axis[2][k] = o.ab[k] / length;
        out.origin[k] = o.a[k] + o.ab[k] / 2;
    }
    return out;
}
template <class T> standing_shape<T> standing(const box_obstacle<T>& o) {
    standing_shape<T> out;
    out.shape = {core_kind::box, {o.half[0], o.half[1], o.half[2]}, o.rounding, 0, nullptr};
    for (int k = 0; k < 3; ++k) std::copy_n(o.axis[k], 3, out.axis[k]);
    std::copy_n(o.center, 3, out.origin);
    return out;
}
template <class T> standing_shape<T> standing(const cylinder_obstacle<T>& o) {
    standing_shape<T> out;
    out.shape = {core_kind::cylinder, {o.radius, o.radius, o.half_length}, o.rounding, 0, nullptr};
    out.along(o.axis);
    std::copy_n(o.center, 3, out.origin);
    return out;
}
template <class T> standing_shape<T> standing(const polytope_obstacle<T>& o) {
    standing_shape<T> out;
    out.shape = {core_kind::polytope,
                 {},
                 o.rounding,
                 static_cast<int>(o.vertices.size()),
                 reinterpret_cast<const T(*)[3]>(o.vertices.data())};
    std::copy_n(o.center, 3, out.origin);
    return out;
}
// The distance of a shape and an obstacle of any kind.
template <class T, class Shape>
pack<T> signed_distance(const placed_shape<T>& a, const Shape& o, T enough, bool depth = true) {
    const standing_shape<T> other = standing(o);
    return signed_distance(a, other.placed(), enough, depth);
}
// A link's axis by a polytope: as of the other shapes, but for an end that is exact.
template <class T>
pack<T> axis_distance(const polytope_obstacle<T>& o, const vec3<T>& a, const vec3<T>& ab, T inverse_squared_length) {
    const bool is_point = inverse_squared_length == T(0);
    const T length = is_point ? T(0) : 1 / std::sqrt(inverse_squared_length);
    const pack<T> zero(T(0)), half(T(0.5));
    const convex_shape<T> segment{core_kind::segment, {T(0), T(0), length / 2}, T(0), 0, nullptr};
    const vec3<T> none{zero, zero, zero}, way = is_point ? none : ab;
    const placed_shape<T> axis{&segment,
                               {none, none, is_point ? none : scaled(way, pack<T>(1 / length))},
                               is_point ? a : a + scaled(way, half)};
    return signed_distance(axis, o, std::numeric_limits<T>::max());
}

// Whether a point is further from a node's box than `reach`, along one of the axes.
template <class T> SPACEARM_INLINE pack_mask<T> beyond_box(const vec3<T>& p, T reach, const obstacle_node<T>& n) {
    const pack<T> x = max(pack<T>(n.lower[0]) - p.x, p.x - n.upper[0]);
    const pack<T> y = max(pack<T>(n.lower[1]) - p.y, p.y - n.upper[1]);
    const pack<T> z = max(pack<T>(n.lower[2]) - p.z, p.z - n.upper[2]);
    return pack<T>(reach) <= max(max(x, y), z);
}

}  // namespace SPACEARM_NAMESPACE
