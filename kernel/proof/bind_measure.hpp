// Measured clearances in Python: for pairs near at an end, for the closest approach, and for tests of the nearest
// points.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/tuple.h>

#include <algorithm>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <tuple>

#include "proof/measure.hpp"

namespace spacearm_proof {

template <class T, int... Shape>
using measured_array = nanobind::ndarray<const T, nanobind::shape<Shape...>, nanobind::c_contig, nanobind::device::cpu>;
using least_array = nanobind::ndarray<nanobind::numpy, double, nanobind::ndim<3>>;
using which_array = nanobind::ndarray<nanobind::numpy, std::int64_t, nanobind::ndim<4>>;

template <class T> T* owned_by(nanobind::capsule& owner, std::size_t count) {
    T* out = new T[count + 1];
    owner = nanobind::capsule(out, [](void* p) noexcept { delete[] static_cast<T*>(p); });
    return out;
}

// (r, links, obstacles + links) at instants u (r), `fill` where nothing is below the limit; and the two bodies
// (r, links, obstacles + links, 2), or -1.
inline std::tuple<least_array, which_array> least_clearances(Clearances& clearances, measured_array<double, -1> u,
                                                             measured_array<double, -1, -1> limit,
                                                             measured_array<double, -1, -1> fill, bool in_tube) {
    const std::size_t instants = u.shape(0), links = limit.shape(0), columns = limit.shape(1), each = links * columns;
    if (columns < links || fill.shape(0) != links || fill.shape(1) != columns)
        throw std::invalid_argument("limits: expected (l, k + l) for l links and k obstacles");
    clearances.require_owners(links, columns - links);
    nanobind::capsule owner, which_owner;
    double* out = owned_by<double>(owner, instants * each);
    std::int64_t* which = owned_by<std::int64_t>(which_owner, 2 * instants * each);
    std::fill_n(which, 2 * instants * each, -1);
    clearances.begin(static_cast<int>(links), static_cast<int>(columns - links), limit.data(), in_tube);
    for (std::size_t i = 0; i < instants; ++i) {
        std::copy_n(fill.data(), each, out + i * each);
        clearances.least(u.data()[i], out + i * each, which + 2 * i * each);
    }
    const std::size_t shape[3] = {instants, links, columns}, which_shape[4] = {instants, links, columns, 2};
    return {least_array(out, 3, shape, owner), which_array(which, 4, which_shape, which_owner)};
}

inline int body_of(const measured_array<std::int64_t, -1>& from, std::size_t i, int count) {
    const std::int64_t body = from.data()[i];
    if (body < 0 || body >= count)
        throw std::invalid_argument("a body is " + std::to_string(body) + ", expected 0 to "
                                    + std::to_string(count - 1));
    return static_cast<int>(body);
}

// The clearances (r) of pairs of shapes, each at an instant of its own.
inline nanobind::ndarray<nanobind::numpy, double, nanobind::ndim<1>>
clearances_between(Clearances& clearances, measured_array<double, -1> u, measured_array<std::int64_t, -1> first,
                   measured_array<std::int64_t, -1> other, bool in_tube) {
    const std::size_t instants = u.shape(0);
    if (first.shape(0) != instants || other.shape(0) != instants)
        throw std::invalid_argument("clearances: expected two bodies for each instant");
    nanobind::capsule owner;
    double* out = owned_by<double>(owner, instants);
    for (std::size_t i = 0; i < instants; ++i)
        out[i] = clearances.between(u.data()[i], body_of(first, i, clearances.count()),
                                    body_of(other, i, clearances.count()), in_tube);
    const std::size_t shape[1] = {instants};
    return nanobind::ndarray<nanobind::numpy, double, nanobind::ndim<1>>(out, 1, shape, owner);
}

// A body, as arrays.
struct GivenBody {
    measured_array<double, -1, 3> points;
    double disc;
    measured_array<double, 3> axis;
    double radius;
    bool half_space;
    PlacedBody placed() const {
        const double* n = axis.data();
        return {points.data(), static_cast<int>(points.shape(0)), disc, {n[0], n[1], n[2]}, radius, half_space};
    }
};

inline std::tuple<double, std::tuple<double, double, double>, bool> nearest_of(const GivenBody& a, const GivenBody& b) {
    const Nearest out = nearest_points(a.placed(), b.placed());
    return {out.clearance, {out.n[0], out.n[1], out.n[2]}, out.apart};
}

// All but how `Clearances` are made.
inline nanobind::class_<Clearances> bind_measure(nanobind::module_& m) {
    using namespace nanobind::literals;
    nanobind::class_<GivenBody>(m, "PlacedBody", "A convex body in world coordinates; see `ConvexBodies`.")
        .def(
            "__init__",
            [](GivenBody* self, measured_array<double, -1, 3> points, double disc, measured_array<double, 3> axis,
               double radius, bool half_space) {
                if (points.shape(0) == 0) throw std::invalid_argument("a body has no points");
                new (self) GivenBody{points, disc, axis, radius, half_space};
            },
            nanobind::kw_only(), "points"_a, "disc"_a, "axis"_a, "radius"_a, "half_space"_a);
    m.def(
        "nearest_points", &nearest_of, "first"_a, "other"_a,
        "Return the clearance of two bodies, not above 0 where they meet [m]; the unit vector in which they are apart, "
        "from the other one to the first; and whether it separates their cores.");
    return nanobind::class_<Clearances>(m, "Clearances", "Measures the clearances of the tables' pairs along a path.")
        .def("least", &least_clearances, "u"_a, "limit"_a, "fill"_a, "in_tube"_a = false,
             "Return the least clearance of every link and other body (r, l, k + l), obstacles first, then links, at "
             "instants (r,) of the path [m]; and the two shapes that have it (r, l, k + l, 2), or -1. Two links are in "
             "the row of the one that comes first. Where nothing is found below `limit` (l, k + l) it is `fill` "
             "(l, k + l). Pairs with a limit of minus infinity are left out. In the tube: less what the "
             "tracking error may take.")
        .def("between", &clearances_between, "u"_a, "first"_a, "other"_a, "in_tube"_a = false,
             "Return the clearances (r,) of pairs of shapes (r,) and (r,), each at an instant (r,) of its own [m].");
}

}  // namespace spacearm_proof
