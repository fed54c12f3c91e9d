// Measured clearances in Python.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/tuple.h>

#include <cstdint>
#include <stdexcept>
#include <string>
#include <tuple>

#include "proof/measure.hpp"

namespace spacearm_proof {

template <class T, int... Shape>
using measured_array = nanobind::ndarray<const T, nanobind::shape<Shape...>, nanobind::c_contig, nanobind::device::cpu>;

inline void require_rows(const char* what, std::size_t found, std::size_t expected) {
    if (found != expected)
        throw std::invalid_argument(std::string(what) + ": " + std::to_string(found) + " rows, expected "
                                    + std::to_string(expected));
}
inline std::vector<int> places(const char* what, const measured_array<std::int64_t, -1>& from, std::size_t most) {
    std::vector<int> out;
    for (std::size_t i = 0; i < from.shape(0); ++i) {
        const std::int64_t place = from.data()[i];
        if (place < 0 || place >= static_cast<std::int64_t>(most))
            throw std::invalid_argument(std::string(what) + ": " + std::to_string(place) + ", expected 0 to "
                                        + std::to_string(most));
        out.push_back(static_cast<int>(place));
    }
    return out;
}

// The columns of `ConvexBodies`, which says what they mean. They were checked there.
inline Bodies measured_bodies(measured_array<std::int64_t, -1> frame, measured_array<std::int64_t, -1> first_point,
                              measured_array<std::int64_t, -1> points, measured_array<double, -1, 3> vertices,
                              measured_array<double, -1> disc, measured_array<double, -1, 3> axis,
                              measured_array<double, -1> radius, measured_array<double, -1, 3> center,
                              measured_array<double, -1> reach, measured_array<bool, -1> half_space,
                              measured_array<std::int64_t, -1> first_member, measured_array<std::int64_t, -1> members,
                              measured_array<std::int64_t, -1> owner) {
    const std::size_t count = frame.shape(0);
    for (const std::size_t rows :
         {first_point.shape(0), points.shape(0), disc.shape(0), axis.shape(0), radius.shape(0), center.shape(0),
          reach.shape(0), half_space.shape(0), first_member.shape(0), members.shape(0), owner.shape(0)})
        require_rows("bodies", rows, count);
    Bodies out;
    out.vertices.assign(vertices.data(), vertices.data() + 3 * vertices.shape(0));
    const auto whole = [](const measured_array<std::int64_t, -1>& from, std::size_t i) {
        return static_cast<int>(from.data()[i]);
    };
    for (std::size_t i = 0; i < count; ++i) {
        Body body{};
        body.frame = whole(frame, i), body.first_point = whole(first_point, i), body.points = whole(points, i);
        body.first_member = whole(first_member, i), body.members = whole(members, i), body.owner = whole(owner, i);
        body.half_space = half_space.data()[i];
        body.disc = disc.data()[i], body.radius = radius.data()[i], body.reach = reach.data()[i];
        body.axis = vector_at(axis.data() + 3 * i), body.center = vector_at(center.data() + 3 * i);
        out.list.push_back(body);
    }
    return out;
}

// (r, links, obstacles + links) at instants with the frames (r, frames, 3, 4); `fill` where nothing is below it.
inline nanobind::ndarray<nanobind::numpy, double, nanobind::ndim<3>>
least_clearances(Clearances& clearances, measured_array<double, -1, -1, 3, 4> frames,
                 measured_array<double, -1, -1> limit, measured_array<double, -1, -1> fill) {
    const std::size_t instants = frames.shape(0), links = limit.shape(0), columns = limit.shape(1);
    if (columns < links || fill.shape(0) != links || fill.shape(1) != columns)
        throw std::invalid_argument("limits: expected (l, k + l) for l links and k obstacles");
    clearances.require(static_cast<int>(frames.shape(1)), static_cast<int>(links), static_cast<int>(columns - links));
    auto* out = new double[instants * links * columns];
    nanobind::capsule owner(out, [](void* p) noexcept { delete[] static_cast<double*>(p); });
    for (std::size_t i = 0; i < instants; ++i) {
        double* into = out + i * links * columns;
        std::copy_n(fill.data(), links * columns, into);
        clearances.least(frames.data() + 12 * frames.shape(1) * i, static_cast<int>(links),
                         static_cast<int>(columns - links), limit.data(), into);
    }
    const std::size_t shape[3] = {instants, links, columns};
    return nanobind::ndarray<nanobind::numpy, double, nanobind::ndim<3>>(out, 3, shape, owner);
}

// The clearance of two bodies [m], the direction from the second to the first, and whether it separates their cores.
inline std::tuple<double, std::tuple<double, double, double>, bool>
nearest_of_points(measured_array<double, -1, 3> points, double disc, measured_array<double, 3> axis, double radius,
                  bool half_space, measured_array<double, -1, 3> other_points, double other_disc,
                  measured_array<double, 3> other_axis, double other_radius, bool other_half_space) {
    const auto placed = [](const measured_array<double, -1, 3>& at, double disc, const measured_array<double, 3>& axis,
                           double radius, bool half_space) {
        if (at.shape(0) == 0) throw std::invalid_argument("a body has no points, expected at least one");
        const double* n = axis.data();
        return PlacedBody{at.data(), static_cast<int>(at.shape(0)), disc, {n[0], n[1], n[2]}, radius, half_space};
    };
    const Nearest out = nearest_points(placed(points, disc, axis, radius, half_space),
                                       placed(other_points, other_disc, other_axis, other_radius, other_half_space));
    return {out.clearance, {out.n[0], out.n[1], out.n[2]}, out.apart};
}

inline void bind_measure(nanobind::module_& m) {
    using namespace nanobind::literals;
    m.def("nearest_points", &nearest_of_points, "points"_a, "disc"_a, "axis"_a, "radius"_a, "half_space"_a,
          "other_points"_a, "other_disc"_a, "other_axis"_a, "other_radius"_a, "other_half_space"_a,
          "Return the clearance of two convex bodies [m], negative or 0 where they meet; the unit vector in which they "
          "are apart, from the other one to the first; and whether it separates their cores.\n\n"
          "A body is all within `radius` of the hull of its points (k, 3), widened by a disc across `axis` (3,), or a "
          "half-space below its only point along `axis`.");
    nanobind::class_<Clearances>(m, "Clearances", "Measures clearances of pairs of bodies of a table at instants.")
        .def(
            "__init__",
            [](Clearances* self, measured_array<std::int64_t, -1> frame, measured_array<std::int64_t, -1> first_point,
               measured_array<std::int64_t, -1> points, measured_array<double, -1, 3> vertices,
               measured_array<double, -1> disc, measured_array<double, -1, 3> axis, measured_array<double, -1> radius,
               measured_array<double, -1, 3> center, measured_array<double, -1> reach,
               measured_array<bool, -1> half_space, measured_array<std::int64_t, -1> first_member,
               measured_array<std::int64_t, -1> members, measured_array<std::int64_t, -1> owner,
               measured_array<std::int64_t, -1> first, measured_array<std::int64_t, -1> other) {
                require_rows("other", other.shape(0), first.shape(0));
                Bodies bodies = measured_bodies(frame, first_point, points, vertices, disc, axis, radius, center, reach,
                                                half_space, first_member, members, owner);
                const std::size_t count = frame.shape(0);
                new (self) Clearances(std::move(bodies), places("first", first, count), places("other", other, count));
            },
            nanobind::kw_only(), "frame"_a, "first_point"_a, "points"_a, "vertices"_a, "disc"_a, "axis"_a, "radius"_a,
            "center"_a, "reach"_a, "half_space"_a, "first_member"_a, "members"_a, "owner"_a, "first"_a, "other"_a,
            "Take the columns of ConvexBodies, and the pairs of outermost bodies that are kept apart.")
        .def(
            "least", &least_clearances, "frames"_a, "limit"_a, "fill"_a,
            "Return the least clearance of every link and other body (r, l, k + l), obstacles first, then links, at "
            "instants with the frames (r, f, 3, 4), world and base first [m]. Two links are in the row of the one that "
            "comes first. Where nothing is found below `limit` (l, k + l) it is `fill` (l, k + l); pairs with a limit "
            "of "
            "minus infinity are left out.");
}

}  // namespace spacearm_proof
