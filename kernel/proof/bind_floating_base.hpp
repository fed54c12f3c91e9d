// The floating base in Python: what the finder takes, and what tests compare with the proof's own bounds.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <stdexcept>

#include "proof/floating_base.hpp"

namespace spacearm_proof {

template <class T, int... Shape>
using base_array = nanobind::ndarray<const T, nanobind::shape<Shape...>, nanobind::c_contig, nanobind::device::cpu>;

inline nanobind::ndarray<nanobind::numpy, double> new_array(std::vector<double> values,
                                                            std::initializer_list<std::size_t> shape) {
    auto* owned = new std::vector<double>(std::move(values));
    nanobind::capsule owner(owned, [](void* p) noexcept { delete static_cast<std::vector<double>*>(p); });
    return {owned->data(), shape, owner};
}

// The fields of Python's `BaseMotionBounds` for r stretches.
inline nanobind::dict bounds_of_stretches(const FloatingBase& base, base_array<double, -1, -1, 3, 4> frames,
                                          base_array<double, -1, -1> rate, base_array<double, -1, -1> deviation,
                                          base_array<double, -1, -1> step, base_array<double, -1> half) {
    const std::size_t r = frames.shape(0), j = base.joints();
    if (frames.shape(1) != j + 1 || half.shape(0) != r)
        throw std::invalid_argument("bounds: the frames are not those of the joints and the base");
    for (const auto* rows : {&rate, &deviation, &step}) {
        if (rows->shape(0) != r || rows->shape(1) != j)
            throw std::invalid_argument("bounds: expected a number for every joint on every stretch");
    }
    std::vector<double> com, lever, share(j), velocity, omega, rotation, second;
    BaseBounds out{};
    for (std::size_t i = 0; i < r; ++i) {
        const double* T = frames.data() + 12 * (j + 1) * i;
        base.bounds(T, T + 12 * j, rate.data() + j * i, deviation.data() + j * i, step.data() + j * i, half.data()[i],
                    out);
        com.insert(com.end(), out.com, out.com + 3);
        lever.insert(lever.end(), out.com_lever.begin(), out.com_lever.end());
        velocity.insert(velocity.end(), out.com_velocity, out.com_velocity + 3);
        omega.insert(omega.end(), out.omega, out.omega + 3);
        rotation.push_back(out.rotation);
        second.push_back(out.rotation_second_order);
        share.assign(out.mass_share, out.mass_share + j);
    }
    nanobind::dict fields;
    fields["com"] = new_array(std::move(com), {r, 3});
    fields["com_lever"] = new_array(std::move(lever), {r, j, 3});
    fields["mass_share"] = new_array(std::move(share), {j});
    fields["com_velocity"] = new_array(std::move(velocity), {r, 3});
    fields["omega"] = new_array(std::move(omega), {r, 3});
    fields["rotation"] = new_array(std::move(rotation), {r});
    fields["rotation_second_order"] = new_array(std::move(second), {r});
    fields["attitude_error"] = out.attitude_error;
    return fields;
}

// T_w_base (r, 3, 4) at places u (r) of the path, for T_base_joint (r, j, 3, 4) there.
inline nanobind::ndarray<nanobind::numpy, double> places_of_base(const FloatingBase& base, base_array<double, -1> u,
                                                                 base_array<double, -1, -1, 3, 4> frames) {
    const std::size_t r = u.shape(0), j = base.joints();
    if (frames.shape(0) != r || frames.shape(1) != j)
        throw std::invalid_argument("place: the frames are not those of the joints");
    std::vector<double> out(12 * r);
    for (std::size_t i = 0; i < r; ++i) base.place(u.data()[i], frames.data() + 12 * j * i, &out[12 * i]);
    return new_array(std::move(out), {r, 3, 4});
}

inline void bind_floating_base(nanobind::module_& m) {
    using namespace nanobind::literals;
    nanobind::class_<FloatingBase>(m, "FloatingBase")
        .def(
            "__init__",
            [](FloatingBase* self, base_array<int, -1> parent, base_array<bool, -1> revolute,
               base_array<int, -1> joint_of_body, base_array<double, -1> mass, base_array<double, -1, 3> com,
               base_array<double, -1, 3, 3> inertia, base_array<double, -1> greatest, base_array<double, -1> spread,
               double base_least, base_array<double, -1, 2> ends, base_array<double, -1, 4> start,
               base_array<double, -1, -1, 4> coefficients, double begin, base_array<double, 3> center,
               base_array<double, 3> velocity, base_array<double, 3> angular, double attitude_error) {
                const std::size_t j = parent.shape(0), b = mass.shape(0), p = ends.shape(0);
                if (revolute.shape(0) != j || joint_of_body.shape(0) != b || com.shape(0) != b || inertia.shape(0) != b
                    || greatest.shape(0) != b || spread.shape(0) != b || start.shape(0) != p
                    || coefficients.shape(0) != p || p < 1)
                    throw std::invalid_argument("FloatingBase: its arrays are of different lengths");
                for (std::size_t k = 0; k < j; ++k) {
                    if (parent.data()[k] >= static_cast<int>(k) || parent.data()[k] < -1)
                        throw std::invalid_argument("FloatingBase: a joint comes before its parent");
                }
                for (std::size_t k = 0; k < b; ++k) {
                    if (joint_of_body.data()[k] >= static_cast<int>(j) || joint_of_body.data()[k] < -1)
                        throw std::invalid_argument("FloatingBase: a body is on a joint that is not there");
                }
                new (self) FloatingBase({.joints = static_cast<int>(j),
                                         .bodies = static_cast<int>(b),
                                         .panels = static_cast<int>(p),
                                         .points = static_cast<int>(coefficients.shape(1)),
                                         .parent = parent.data(),
                                         .revolute = revolute.data(),
                                         .joint_of_body = joint_of_body.data(),
                                         .mass = mass.data(),
                                         .com = com.data(),
                                         .inertia = inertia.data(),
                                         .greatest = greatest.data(),
                                         .spread = spread.data(),
                                         .base_least = base_least,
                                         .ends = ends.data(),
                                         .start = start.data(),
                                         .coefficients = coefficients.data(),
                                         .begin = begin,
                                         .center = center.data(),
                                         .velocity = velocity.data(),
                                         .angular = angular.data(),
                                         .attitude_error = attitude_error});
            },
            nanobind::kw_only(), "parent"_a, "revolute"_a, "joint_of_body"_a, "mass"_a, "com"_a, "inertia"_a,
            "greatest"_a, "spread"_a, "base_least"_a, "ends"_a, "start"_a, "coefficients"_a, "begin"_a, "center"_a,
            "velocity"_a, "angular"_a, "attitude_error"_a)
        .def("place", &places_of_base, "u"_a, "frames"_a)
        .def("bounds", &bounds_of_stretches, "frames"_a, "rate"_a, "deviation"_a, "step"_a, "half"_a);
}

}  // namespace spacearm_proof
