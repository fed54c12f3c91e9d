// Measured clearances in Python: for pairs near at an end, for the closest approach, and for tests of the nearest
// points.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/tuple.h>

#include <algorithm>
#include <cstdint>
#include <optional>
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

// (r, links, obstacles + links) at instants with the frames (r, frames, 3, 4), `fill` where nothing is below the limit;
// and the two bodies (r, links, obstacles + links, 2), or -1.
inline std::tuple<least_array, which_array> least_clearances(Clearances& clearances,
                                                             measured_array<double, -1, -1, 3, 4> frames,
                                                             measured_array<double, -1, -1> limit,
                                                             measured_array<double, -1, -1> fill,
                                                             std::optional<measured_array<double, -1>> tracking) {
    const std::size_t instants = frames.shape(0), links = limit.shape(0), columns = limit.shape(1);
    if (columns < links || fill.shape(0) != links || fill.shape(1) != columns)
        throw std::invalid_argument("limits: expected (l, k + l) for l links and k obstacles");
    clearances.require_frames(frames.shape(1));
    clearances.require_owners(links, columns - links);
    std::optional<Tube> tube;
    if (tracking) tube.emplace(clearances.tube_of(tracking->data(), tracking->shape(0)));
    const std::size_t each = links * columns;
    nanobind::capsule owner, which_owner;
    double* out = owned_by<double>(owner, instants * each);
    std::int64_t* which = owned_by<std::int64_t>(which_owner, 2 * instants * each);
    std::fill_n(which, 2 * instants * each, -1);
    for (std::size_t i = 0; i < instants; ++i) {
        std::copy_n(fill.data(), each, out + i * each);
        clearances.least(frames.data() + 12 * frames.shape(1) * i, static_cast<int>(links),
                         static_cast<int>(columns - links), limit.data(), out + i * each, which + 2 * i * each,
                         tube ? &*tube : nullptr);
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

// The clearances (r) of pairs of bodies, each at an instant of its own with the frames (r, frames, 3, 4).
inline nanobind::ndarray<nanobind::numpy, double, nanobind::ndim<1>>
clearances_between(Clearances& clearances, measured_array<double, -1, -1, 3, 4> frames,
                   measured_array<std::int64_t, -1> first, measured_array<std::int64_t, -1> other) {
    const std::size_t instants = frames.shape(0);
    if (first.shape(0) != instants || other.shape(0) != instants)
        throw std::invalid_argument("clearances: expected two bodies for each instant");
    clearances.require_frames(frames.shape(1));
    nanobind::capsule owner;
    double* out = owned_by<double>(owner, instants);
    for (std::size_t i = 0; i < instants; ++i)
        out[i] = clearances.between(frames.data() + 12 * frames.shape(1) * i, body_of(first, i, clearances.count()),
                                    body_of(other, i, clearances.count()));
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

inline void bind_measure(nanobind::module_& m) {
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
    nanobind::class_<Clearances>(m, "Clearances", "Measures the clearances of the tables' pairs at instants.")
        .def(nanobind::init<const Tables&>(), "tables"_a, nanobind::keep_alive<1, 2>())
        .def("least", &least_clearances, "frames"_a, "limit"_a, "fill"_a, "tracking"_a = nanobind::none(),
             "Return the least clearance of every link and other body (r, l, k + l), obstacles first, then links, at "
             "instants with the frames (r, f, 3, 4), world and base first [m]; and the two shapes that have it "
             "(r, l, k + l, 2), or -1. Two links are in the row of the one that comes first. Where nothing is found "
             "below `limit` (l, k + l) it is `fill` (l, k + l). Pairs with a limit of minus infinity are left out. "
             "What a tracking error (n,) may take is taken from all clearances.")
        .def("between", &clearances_between, "frames"_a, "first"_a, "other"_a,
             "Return the clearances (r,) of pairs of bodies, each with the frames (r, f, 3, 4) of an instant [m].");
}

}  // namespace spacearm_proof
