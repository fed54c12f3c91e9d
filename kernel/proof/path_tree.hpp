// The stretches of a path, which are the nodes of a binary tree, and bounds of the joints' motion on them.
//
// As `proof/path_intervals.py` has them, to the last places: a stretch is a run of pieces or a part of one.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace spacearm_proof {

// A run of the pieces first to last - 1, or a part of the piece `first`.
struct Stretch {
    int first, last;
    double begin, end;
    double share;  // of the path, if all pieces count alike
    double middle() const { return (begin + end) / 2; }
};

// The arrays of a path; they belong to the caller.
struct PathInput {
    int pieces, dofs;                                          // the pieces into which the curve is cut
    const double *ends, *least_rate, *greatest_rate, *second;  // (p, 2), (p, n), (p, n), (p, n)
    const double* size;                                        // (n)
    double rounding;
    int polynomials, degree;     // the curve's own pieces
    const double* breaks;        // (polynomials + 1)
    const double* coefficients;  // (polynomials, degree + 1, n) by Bernstein
};

class Path {
  public:
    explicit Path(const PathInput& from) : in_(from), binomials_(from.degree + 1), rate_binomials_(from.degree + 1) {
        fill_binomials(in_.degree, binomials_);
        if (in_.degree > 0) fill_binomials(in_.degree - 1, rate_binomials_);
        if (in_.pieces > few) build_ranges();
    }

    int dofs() const { return in_.dofs; }

    Stretch whole() const { return {0, in_.pieces, in_.ends[0], in_.ends[2 * in_.pieces - 1], 1.0}; }

    void halve(const Stretch& of, Stretch& one, Stretch& other) const {
        one = other = of;
        if (of.last - of.first > 1) {
            const int between = (of.first + of.last) / 2;
            one.last = other.first = between;
            one.end = other.begin = in_.ends[2 * between];
            for (Stretch* half : {&one, &other}) half->share = double(half->last - half->first) / in_.pieces;
        } else {
            one.end = other.begin = of.middle();
            one.share = other.share = of.share / 2;
        }
    }

    double half(const Stretch& of) const {
        return (of.end - of.begin) / 2 + 2 * eps * std::max(std::abs(of.begin), std::abs(of.end));
    }

    // q at u (n).
    void sample(double u, double* q) const {
        const int piece = piece_at(u);
        evaluate(in_.coefficients + coefficients_at(piece), in_.degree, binomials_, place(u, piece), q);
    }

    // q (n), and the straight line through the midpoint: rate w and deviation e (n).
    void linear_bounds(const Stretch& of, double* q, double* rate, double* deviation) {
        const double u = of.middle(), h = half(of);
        const int n = in_.dofs;
        sample(u, q);
        const bool run = of.last - of.first > 1 || !(u > of.begin && u < of.end);
        if (run) {
            least_.assign(n, infinite);
            most_.assign(n, -infinite);
            range(of.first, of.last);
        } else sample_rate(u, rate);
        const double joins = join_rounding * std::max(0, of.last - of.first - 1);
        for (int i = 0; i < n; ++i) {
            double speed;
            if (run) {
                rate[i] = (least_[i] + most_[i]) / 2;
                deviation[i] = (most_[i] - least_[i]) / 2 * h;
                speed = std::max(-least_[i], most_[i]);
            } else {
                const std::size_t at = static_cast<std::size_t>(of.first) * n + i;
                deviation[i] = in_.second[at] * h * h / 2;
                speed = std::max(-in_.least_rate[at], in_.greatest_rate[at]);
            }
            deviation[i] += joins * in_.size[i] + in_.rounding * (in_.size[i] + speed * h + deviation[i]);
        }
    }

  private:
    static constexpr double eps = std::numeric_limits<double>::epsilon();
    static constexpr double infinite = std::numeric_limits<double>::infinity();
    static constexpr double join_rounding = 64 * eps;
    static constexpr int few = 64;  // up to this number of pieces a range is looked through

    static void fill_binomials(int degree, std::vector<double>& into) {
        into[0] = 1;
        for (int i = 1; i <= degree; ++i) into[i] = into[i - 1] * (degree - i + 1) / i;
    }

    int piece_at(double u) const {
        const double* begin = in_.breaks;
        const int after = static_cast<int>(std::upper_bound(begin, begin + in_.polynomials + 1, u) - begin);
        return std::clamp(after - 1, 0, in_.polynomials - 1);
    }
    double piece_length(int piece) const { return in_.breaks[piece + 1] - in_.breaks[piece]; }
    double place(double u, int piece) const {
        return std::clamp((u - in_.breaks[piece]) / piece_length(piece), 0.0, 1.0);
    }
    std::size_t coefficients_at(int piece) const {
        return static_cast<std::size_t>(piece) * (in_.degree + 1) * in_.dofs;
    }

    // The Bernstein polynomials at x into weights_.
    void fill_weights(int degree, const std::vector<double>& binomials, double x) const {
        weights_.resize(degree + 1);
        double power = 1;
        for (int i = 0; i <= degree; ++i, power *= x) weights_[i] = binomials[i] * power;
        power = 1;
        for (int i = degree; i >= 0; --i, power *= 1 - x) weights_[i] *= power;
    }
    void evaluate(const double* c, int degree, const std::vector<double>& binomials, double x, double* out) const {
        fill_weights(degree, binomials, x);
        std::fill(out, out + in_.dofs, 0.0);
        for (int i = 0; i <= degree; ++i, c += in_.dofs)
            for (int k = 0; k < in_.dofs; ++k) out[k] += weights_[i] * c[k];
    }
    void sample_rate(double u, double* rate) const {
        const int piece = piece_at(u), n = in_.dofs;
        std::fill(rate, rate + n, 0.0);
        if (in_.degree == 0) return;
        fill_weights(in_.degree - 1, rate_binomials_, place(u, piece));
        const double scale = in_.degree / piece_length(piece);
        const double* c = in_.coefficients + coefficients_at(piece);
        for (int i = 0; i < in_.degree; ++i, c += n)
            for (int k = 0; k < n; ++k) rate[k] += weights_[i] * (c[n + k] - c[k]);
        for (int k = 0; k < n; ++k) rate[k] *= scale;
    }

    // ---- the range of the rates on a run of pieces, by a tree of ranges ---------------------------------------------

    void merge(const double* least, const double* most) {
        for (int k = 0; k < in_.dofs; ++k) {
            least_[k] = std::min(least_[k], least[k]);
            most_[k] = std::max(most_[k], most[k]);
        }
    }
    void range(int first, int last) {
        const std::size_t n = in_.dofs;
        if (ranges_.empty()) {
            for (int i = first; i < last; ++i) merge(in_.least_rate + i * n, in_.greatest_rate + i * n);
            return;
        }
        for (std::size_t a = first + std::size_t(in_.pieces), b = last + std::size_t(in_.pieces); a < b;
             a /= 2, b /= 2) {
            if (a % 2) merge_node(a++);
            if (b % 2) merge_node(--b);
        }
    }
    void merge_node(std::size_t node) { merge(&ranges_[2 * node * in_.dofs], &ranges_[(2 * node + 1) * in_.dofs]); }
    void build_ranges() {  // node i has the children 2 i and 2 i + 1; the pieces are the last ones
        const std::size_t n = in_.dofs, pieces = in_.pieces;
        ranges_.resize(4 * pieces * n);
        for (std::size_t i = 0; i < pieces; ++i) {
            std::copy(in_.least_rate + i * n, in_.least_rate + (i + 1) * n, &ranges_[2 * (pieces + i) * n]);
            std::copy(in_.greatest_rate + i * n, in_.greatest_rate + (i + 1) * n, &ranges_[(2 * (pieces + i) + 1) * n]);
        }
        for (std::size_t i = pieces - 1; i > 0; --i) {
            const double *a = &ranges_[4 * i * n], *b = a + 2 * n;
            double* to = &ranges_[2 * i * n];
            for (std::size_t k = 0; k < n; ++k) {
                to[k] = std::min(a[k], b[k]);
                to[n + k] = std::max(a[n + k], b[n + k]);
            }
        }
    }

    PathInput in_;
    std::vector<double> binomials_, rate_binomials_, ranges_, least_, most_;
    mutable std::vector<double> weights_;
};

}  // namespace spacearm_proof
