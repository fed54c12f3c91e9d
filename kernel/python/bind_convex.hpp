// The distances of two convex shapes at many poses: for tests, and for what is analysed without a model.
#pragma once

#include <array>

#include "geometry/convex.hpp"
#include "python/threads.hpp"

namespace SPACEARM_NAMESPACE {

// A shape in double, with its vertices.
struct convex_description {
    core_kind kind = core_kind::segment;
    double half[3] = {};
    double radius = 0;
    std::vector<std::array<double, 3>> vertices;  // of a polytope
};

inline convex_description convex_description_from(core_kind kind, in_vector half, double radius,
                                                  fixed_array<-1, 3> vertices) {
    convex_description out{kind, {}, radius, {}};
    take(half, out.half);
    for (std::size_t i = 0; i < vertices.shape(0); ++i)
        out.vertices.push_back({vertices(i, 0), vertices(i, 1), vertices(i, 2)});
    require(all_within(out.half, widest) && within(radius, widest), "a shape's number that is none, or too large");
    for (const auto& v : out.vertices) require(all_within(v, widest), "a vertex's number that is none, or too large");
    require((kind == core_kind::polytope) == !out.vertices.empty(), "a polytope has vertices, and nothing else has");
    require(out.vertices.size() < (1u << 20), "too many vertices");
    return out;
}

// The same in another scalar; it owns its vertices.
template <class T> struct kept_convex_shape {
    std::vector<std::array<T, 3>> vertices;
    convex_shape<T> shape{};
    explicit kept_convex_shape(const convex_description& given) {
        for (const auto& v : given.vertices)
            vertices.push_back({static_cast<T>(v[0]), static_cast<T>(v[1]), static_cast<T>(v[2])});
        shape.kind = given.kind;
        for (int k = 0; k < 3; ++k) shape.half[k] = static_cast<T>(given.half[k]);
        shape.radius = static_cast<T>(given.radius);
        shape.count = static_cast<int>(vertices.size());
        shape.vertices = reinterpret_cast<const T(*)[3]>(vertices.data());
    }
    kept_convex_shape(const kept_convex_shape&) = delete;
    kept_convex_shape& operator=(const kept_convex_shape&) = delete;
};

using in_poses = fixed_array<-1, 4, 4>;

// A pack of poses, the last of which is repeated.
template <class T>
placed_shape<T> placed(const convex_shape<T>& shape, const in_poses& poses, std::size_t first, std::size_t filled) {
    constexpr std::size_t W = lanes_of<T>;
    T entry[3][4][W];
    for (std::size_t i = 0; i < W; ++i) {
        const double* T_w_shape = poses.data() + 16 * (first + std::min(i, filled - 1));
        for (int r = 0; r < 3; ++r) {
            for (int c = 0; c < 4; ++c) entry[r][c][i] = static_cast<T>(T_w_shape[4 * r + c]);
        }
    }
    const auto column = [&](int c) {
        return vec3<T>{pack<T>::load(entry[0][c]), pack<T>::load(entry[1][c]), pack<T>::load(entry[2][c])};
    };
    return {&shape, {column(0), column(1), column(2)}, column(3)};
}

template <class T>
out_array<double, 1> convex_distances(const convex_description& a, in_poses poses_a, const convex_description& b,
                                      in_poses poses_b, double enough) {
    require(poses_a.shape(0) == poses_b.shape(0), "poses of different numbers");
    const std::size_t count = poses_a.shape(0);
    std::vector<double> out(count);
    {
        nb::gil_scoped_release free;
        signal_listener signals;
        const kept_convex_shape<T> one(a), two(b);
        for (std::size_t i = 0; i < count; i += lanes_of<T>) {
            if (i % 4096 == 0) signals.ask();
            const std::size_t filled = std::min<std::size_t>(lanes_of<T>, count - i);
            T lane[lanes_of<T>];
            signed_distance(placed(one.shape, poses_a, i, filled), placed(two.shape, poses_b, i, filled),
                            static_cast<T>(enough))
                .store(lane);
            for (std::size_t k = 0; k < filled; ++k) out[i + k] = double(lane[k]);
        }
    }
    return row_of(std::move(out));
}

inline void bind_convex(nb::module_& m) {
    nb::enum_<core_kind>(m, "CoreKind", "The core of a convex shape; a point is a segment of half length 0.")
        .value("segment", core_kind::segment)
        .value("box", core_kind::box)
        .value("cylinder", core_kind::cylinder)
        .value("polytope", core_kind::polytope);
    nb::class_<convex_description>(m, "ConvexShape",
                                   "All points within a radius of a core; a polytope's vertices are in its own frame.")
        .def(
            "__init__",
            [](convex_description* self, core_kind kind, in_vector half, double radius, fixed_array<-1, 3> vertices) {
                new (self) convex_description(convex_description_from(kind, half, radius, vertices));
            },
            nb::kw_only(), "kind"_a, "half"_a, "radius"_a, "vertices"_a);
    m.def("convex_distances64", &convex_distances<double>, "a"_a, "poses_a"_a, "b"_a, "poses_b"_a, nb::kw_only(),
          "enough"_a,
          "Signed distances (m,) [m] of two shapes at poses (m, 4, 4) each; at `enough` or beyond, that at least.");
    m.def("convex_distances32", &convex_distances<float>, "a"_a, "poses_a"_a, "b"_a, "poses_b"_a, nb::kw_only(),
          "enough"_a, "The same, computed in float.");
}

}  // namespace SPACEARM_NAMESPACE
