// What Python records, with the same bits on every processor: products whose sums have one order, sines, angles and
// roots.
//
// A BLAS chooses its kernels, and with them the order of sums, by the processor; so do NumPy and the C library with
// their sines and powers.
#pragma once

#include "lanes/trig.hpp"
#include "python/arrays.hpp"

namespace SPACEARM_NAMESPACE {

// Matrices (p, m, k) by matrices (p or 1, k, n).
inline out_array<double, 3> matrix_product(in3c a, in3c b) {
    const std::size_t count = a.shape(0), rows = a.shape(1), inner = a.shape(2), columns = b.shape(2);
    require(b.shape(1) == inner && (b.shape(0) == count || b.shape(0) == 1), "the matrices do not fit");
    std::vector<double> out(count * rows * columns, 0.0);
    {
        nb::gil_scoped_release free;
        constexpr std::size_t W = lanes_of<double>;
        const std::size_t blocks = (columns + W - 1) / W;
        std::vector<double> right(blocks * inner * W, 0.0);  // block by block of W columns
        for (std::size_t p = 0; p < count; ++p) {
            for (std::size_t l = 0; l < inner && (p == 0 || b.shape(0) != 1); ++l) {
                for (std::size_t j = 0; j < columns; ++j)
                    right[(j / W * inner + l) * W + j % W] = b.data()[(p * inner + l) * columns + j];
            }
            for (std::size_t i = 0; i < rows; ++i) {
                const double* left = a.data() + (p * rows + i) * inner;
                for (std::size_t k = 0; k < blocks; ++k) {
                    pack<double> sum(0.0);
                    for (std::size_t l = 0; l < inner; ++l)
                        sum += pack<double>::load(&right[(k * inner + l) * W]) * left[l];
                    store_lanes(sum, &out[(p * rows + i) * columns + k * W], std::min(W, columns - k * W));
                }
            }
        }
    }
    return array_of<double, 3>(std::move(out), {count, rows, columns});
}

template <class F> std::vector<double> each(std::size_t n, F&& f) {
    std::vector<double> out(n);
    for (std::size_t i = 0; i < n; ++i) out[i] = f(i);
    return out;
}

inline void bind_exact(nb::module_& m) {
    m.def("product", &matrix_product, "a"_a, "b"_a, "Matrices (p, m, k) by matrices (p or 1, k, n).");
    m.def(
        "sines",
        [](in1<double> x) {
            const std::size_t n = x.shape(0);
            std::vector<double> s(n), c(n);
            for (std::size_t i = 0; i < n; ++i) sincos(x(i), s[i], c[i]);
            return std::pair(row_of(std::move(s)), row_of(std::move(c)));
        },
        "x"_a, "Sines and cosines.");
    m.def(
        "angles",
        [](in1<double> y, in1<double> x) {
            require(y.shape(0) == x.shape(0), "coordinates of different numbers");
            return row_of(each(x.shape(0), [&](std::size_t i) { return angle_of(y(i), x(i)); }));
        },
        "y"_a, "x"_a, "The angles of vectors (x, y) [rad].");
    m.def(
        "cube_roots",
        [](in1<double> x) { return row_of(each(x.shape(0), [&](std::size_t i) { return cube_root(x(i)); })); }, "x"_a);
}

}  // namespace SPACEARM_NAMESPACE
