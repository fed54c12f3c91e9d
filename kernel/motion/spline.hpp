// Clamped quintic splines: what each control point contributes at given instants, and the splines nearest to given
// paths.
//
// A motion has the start three times, K interior control points and the goal three times, on uniform knots; the values
// of the repeated ends are summed, so that there are K + 2 of them: start, interior, goal. Cox-de Boor recursion (Piegl
// and Tiller, The NURBS Book, 1997). Made once a K, so in plain double precision.
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "lanes/lanes.hpp"

namespace SPACEARM_NAMESPACE {

inline constexpr int spline_degree = 5;

// The span that a position x = s (K + 1) is on.
template <class T> int span_of(T x, int interior) {
    return x > T(0) ? static_cast<int>(std::min(x, static_cast<T>(interior))) : 0;
}

// The derivative-th derivative's values that are not 0 at s in [0, 1]: those of six control points, the repeated ends
// one by one. Returns the first of them, which is the span.
inline int six_spline_values(double s, int interior, int derivative, double* out) {
    const auto knot = [&](int i) {
        return std::min(1.0, std::max(0.0, static_cast<double>(i - spline_degree) / (interior + 1)));
    };
    int first = std::min(interior, static_cast<int>(s * (interior + 1)));
    while (first > 0 && s < knot(first + spline_degree)) --first;  // rounding
    while (first < interior && s >= knot(first + spline_degree + 1)) ++first;
    double knots[2 * spline_degree + 2];
    for (int i = 0; i < 2 * spline_degree + 2; ++i) knots[i] = knot(first + i);
    // The polynomial pieces of degree 5 - derivative, then up again with the derivative's factors.
    const int low = spline_degree - derivative, span = spline_degree;
    double values[spline_degree + 2] = {};  // of the basis of the degree at hand, by its first knot
    values[span] = 1;
    for (int degree = 1; degree <= spline_degree; ++degree) {
        for (int i = span - degree; i <= span; ++i) {
            const double left = knots[i + degree] - knots[i], right = knots[i + degree + 1] - knots[i + 1];
            const double here = left > 0 ? values[i] / left : 0.0, next = right > 0 ? values[i + 1] / right : 0.0;
            values[i] =
                degree <= low ? (s - knots[i]) * here + (knots[i + degree + 1] - s) * next : degree * (here - next);
        }
    }
    std::copy(values, values + spline_degree + 1, out);
    return first;
}
// All (K + 2) values, those of the repeated ends summed.
inline std::vector<double> spline_basis(double s, int interior, int derivative) {
    double six[spline_degree + 1];
    const int first = six_spline_values(s, interior, derivative, six);
    std::vector<double> out(interior + 2, 0.0);
    for (int j = 0; j <= spline_degree; ++j) out[std::clamp(first + j - 2, 0, interior + 1)] += six[j];
    return out;
}

// Motions with more control points are looked at span by span: local_spline.hpp.
inline constexpr int most_tabled = 24;

inline constexpr int sample_packs_coarse = 2;  // packs of the coarse check, the first of the fine one's
inline constexpr int sample_packs_fine = 8;

// 0, 1/2, 1/4, 3/4, 1/8, ...: each fills a gap of those before (van der Corput).
inline double gap_filler(int i) {
    double out = 0;
    for (double step = 0.5; i > 0; i /= 2, step /= 2) out += i % 2 * step;
    return out;
}
// The instants of a pack, for as many packs as one likes. Pack 0 has the middles, for the start is free.
inline double sample_instant(int pack_index, int lane, int lanes) {
    return (lane + gap_filler(pack_index < 2 ? 1 - pack_index : pack_index)) / lanes;
}

// Basis values on packs of instants, one pack of lanes a control point.
template <class T> struct spline_table {
    int interior = 0;
    std::vector<T> value[4];  // derivative 0: all fine packs; 1 to 3: the coarse packs
};

// Least squares for a number of control points.
template <class T> struct fit_table {
    int interior = 0;
    // The spline nearest to 2 lanes points of a path: control points = nearest * (points - what the ends contribute).
    std::vector<T> nearest;       // (K, 2 lanes)
    std::vector<T> path_share;    // (2 lanes): how far along the path the points are
    std::vector<T> end_value[2];  // (2 lanes)
    std::vector<T> at_path;       // (2 lanes, K + 2): the values at those instants
};

// Where the values of pack l begin in a table's row of packs.
template <class T> std::size_t pack_offset(int l, int interior) {
    return static_cast<std::size_t>(l) * (interior + 2) * lanes_of<T>;
}

template <class T>
void append_instants(std::vector<T>& out, int interior, int derivative, const std::vector<double>& instants) {
    const std::size_t first = out.size();
    out.resize(first + static_cast<std::size_t>(interior + 2) * lanes_of<T>);
    for (int lane = 0; lane < lanes_of<T>; ++lane) {
        const std::vector<double> b = spline_basis(instants[lane], interior, derivative);
        for (int k = 0; k < interior + 2; ++k)
            out[first + static_cast<std::size_t>(k) * lanes_of<T> + lane] = static_cast<T>(b[k]);
    }
}

template <class T> spline_table<T> make_spline_table(int interior) {
    constexpr int W = lanes_of<T>;
    spline_table<T> t;
    t.interior = interior;
    for (int derivative = 0; derivative < 4; ++derivative) {
        for (int l = 0; l < (derivative ? sample_packs_coarse : sample_packs_fine); ++l) {
            std::vector<double> instants;
            for (int lane = 0; lane < W; ++lane) instants.push_back(sample_instant(l, lane, W));
            append_instants(t.value[derivative], interior, derivative, instants);
        }
    }
    return t;
}
template <class T> fit_table<T> make_fit_table(int interior) {
    constexpr int W = lanes_of<T>;
    fit_table<T> t;
    t.interior = interior;
    // By the normal equations; a trace of damping keeps them sound where a control point does little.
    const int points = 2 * W, K = interior;
    std::vector<std::vector<double>> rows, normal(K, std::vector<double>(K + points, 0.0));
    for (int i = 0; i < points; ++i) {
        const double s = (i + 0.5) / points;
        rows.push_back(spline_basis(s, K, 0));
        t.path_share.push_back(static_cast<T>(s * s * s * (10 - 15 * s + 6 * s * s)));
        t.end_value[0].push_back(static_cast<T>(rows[i][0]));
        t.end_value[1].push_back(static_cast<T>(rows[i][K + 1]));
        for (double b : rows[i]) t.at_path.push_back(static_cast<T>(b));
    }
    for (int a = 0; a < K; ++a) {
        for (int i = 0; i < points; ++i) {
            for (int b = 0; b < K; ++b) normal[a][b] += rows[i][a + 1] * rows[i][b + 1];
            normal[a][K + i] = rows[i][a + 1];
        }
        normal[a][a] += 1e-6;
    }
    for (int a = 0; a < K; ++a) {  // Gauss-Jordan; the matrix is positive definite
        const double pivot = normal[a][a];
        for (double& x : normal[a]) x /= pivot;
        for (int b = 0; b < K; ++b) {
            if (b == a) continue;
            const double factor = normal[b][a];
            for (int i = a; i < K + points; ++i) normal[b][i] -= factor * normal[a][i];
        }
    }
    for (int a = 0; a < K; ++a) {
        for (int i = 0; i < points; ++i) t.nearest.push_back(static_cast<T>(normal[a][K + i]));
    }
    return t;
}

// The tables are the same for every problem: made when first asked for.
template <class Table, class Make> std::shared_ptr<const Table> kept_table(int interior, Make&& make) {
    static std::mutex lock;
    static std::map<int, std::shared_ptr<const Table>> known;
    std::lock_guard<std::mutex> hold(lock);
    auto& entry = known[interior];
    if (!entry) entry = std::make_shared<const Table>(make(interior));
    return entry;
}
template <class T> std::shared_ptr<const spline_table<T>> spline_table_of(int interior) {
    return kept_table<spline_table<T>>(interior, make_spline_table<T>);
}
template <class T> std::shared_ptr<const fit_table<T>> fit_table_of(int interior) {
    return kept_table<fit_table<T>>(interior, make_fit_table<T>);
}

}  // namespace SPACEARM_NAMESPACE
