// What all bindings share: arrays in and out, and checks of what comes in.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/function.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cmath>
#include <optional>

namespace nb = nanobind;
using namespace nb::literals;

namespace SPACEARM_NAMESPACE {

template <class T> using in1 = nb::ndarray<const T, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
template <class T> using in2 = nb::ndarray<const T, nb::ndim<2>, nb::device::cpu>;  // any strides
template <class T> using in2c = nb::ndarray<const T, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

template <class T> nb::object array_of(std::vector<T>&& values, std::initializer_list<std::size_t> shape) {
    auto* owned = new std::vector<T>(std::move(values));
    nb::capsule owner(owned, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
    return nb::cast(nb::ndarray<nb::numpy, T>(owned->data(), shape, owner));
}

inline void require(bool condition, const char* what) {
    if (!condition) throw nb::value_error(what);
}
// A number of a size that may be multiplied, even squared, and stays a number; a NaN is none.
inline bool within(double x, double most) { return std::abs(x) <= most; }
template <class Numbers> bool all_within(const Numbers& numbers, double most) {
    for (std::size_t i = 0; i < numbers.size(); ++i) {
        if (!within(double(numbers.data()[i]), most)) return false;
    }
    return true;
}
inline constexpr double widest = 1e9;  // [m] of robots and scenes: what is squared twice on the way stays a float
inline constexpr int most_dofs = 1 << 16;

}  // namespace SPACEARM_NAMESPACE
