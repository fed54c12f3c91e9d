// Arrays in and out.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/function.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/variant.h>
#include <nanobind/stl/vector.h>

#include <optional>

#include "checks.hpp"
#include "lanes/lanes.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace SPACEARM_NAMESPACE {

template <class T> using in1 = nb::ndarray<const T, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
template <class T> using in2 = nb::ndarray<const T, nb::ndim<2>, nb::device::cpu>;  // any strides
template <class T> using in2c = nb::ndarray<const T, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using in3c = nb::ndarray<const double, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
template <int... Shape>
using fixed_array = nb::ndarray<const double, nb::shape<Shape...>, nb::c_contig, nb::device::cpu>;
using in_vector = fixed_array<3>;
using in_matrix = fixed_array<3, 3>;

// What is told now and then how far a call has come, and answers whether to go on.
using progress_function = std::optional<nb::typed<nb::callable, nb::object(std::int64_t)>>;

template <class T, std::size_t N> using out_array = nb::ndarray<nb::numpy, T, nb::ndim<N>>;
template <class T, std::size_t N> out_array<T, N> array_of(std::vector<T>&& values, const std::size_t (&shape)[N]) {
    auto* owned = new std::vector<T>(std::move(values));
    nb::capsule owner(owned, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
    return out_array<T, N>(owned->data(), N, shape, owner);
}
template <class T> out_array<T, 1> row_of(std::vector<T> values) {
    const std::size_t n = values.size();
    return array_of<T, 1>(std::move(values), {n});
}
// Arrays of truth values: std::vector<bool> has no memory to share.
inline out_array<bool, 1> truths_of(const std::vector<char>& values) {
    auto* owned = new bool[values.size() + 1];
    std::copy(values.begin(), values.end(), owned);
    nb::capsule owner(owned, [](void* p) noexcept { delete[] static_cast<bool*>(p); });
    const std::size_t shape[1] = {values.size()};
    return out_array<bool, 1>(owned, 1, shape, owner);
}

template <class T> std::vector<T> vector_of(const in1<T>& from) { return {from.data(), from.data() + from.shape(0)}; }
template <std::size_t N, class Array> void take(const Array& from, double (&to)[N]) {
    std::copy(from.data(), from.data() + N, to);
}

// Rows of q into packs, a pack of rows at a time; f(first_row, rows_in_pack, packs). Rows beyond the last repeat it.
// Rows are turned into columns a block at a time, so that no pack is read back while its numbers are still being
// written.
template <class T, class F> void for_packs(const in2<T>& q, F&& f) {
    constexpr std::size_t W = lanes_of<T>, block = 32 * W;
    const std::size_t rows = q.shape(0), dims = q.shape(1);
    const std::ptrdiff_t row = q.stride(0), column = q.stride(1);
    std::vector<T> columns(dims * block);
    std::vector<pack<T>> packs(dims);
    for (std::size_t begin = 0; begin < rows; begin += block) {
        const std::size_t filled = std::min(block, rows - begin), padded = (filled + W - 1) / W * W;
        for (std::size_t i = 0; i < padded; ++i) {
            const T* from = q.data() + static_cast<std::ptrdiff_t>(begin + std::min(i, filled - 1)) * row;
            for (std::size_t d = 0; d < dims; ++d)
                columns[d * block + i] = from[static_cast<std::ptrdiff_t>(d) * column];
        }
        for (std::size_t i = 0; i < padded; i += W) {
            for (std::size_t d = 0; d < dims; ++d) packs[d] = pack<T>::load(&columns[d * block + i]);
            f(begin + i, std::min(W, filled - i), packs.data());
        }
    }
}

template <class T> void store_lanes(const pack<T>& p, T* to, std::size_t filled, std::size_t stride = 1) {
    T lane[lanes_of<T>];
    p.store(lane);
    for (std::size_t i = 0; i < filled; ++i) to[i * stride] = lane[i];
}

}  // namespace SPACEARM_NAMESPACE
