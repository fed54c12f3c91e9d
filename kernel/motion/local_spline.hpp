// A motion of many control points, looked at where only six of them count.
//
// A quintic spline is made of spans, one polynomial each, and on a span six neighbouring control points count.
// Positions are told in spans: x = s (K + 1). The lanes of a pack may be on any spans: the six values are computed for
// all lanes at once, then each lane sums its own six control points, the joints side by side.
#pragma once

#include <array>

#include "motion/problem.hpp"

namespace SPACEARM_NAMESPACE {

// [1/rad or 1/m] how many instants of a motion, or of a straight edge, are looked at before any proof failed.
inline constexpr int instants_per_unit = 16;
inline constexpr int looks_a_span = 2;    // instants of a span that length, duration and smoothness are told from
inline constexpr int lengths_a_span = 4;  // steps of a span, at whose ends the length along a motion is known

// The six values that are not 0 at a position, of `Number`s: a double or a pack. `low` is where the span begins.
template <class Number>
SPACEARM_INLINE void six_values(const Number& x, const Number& low, int interior, Number* value) {
    using std::max, std::min;
    const auto inside = [&](const Number& knot) { return min(max(knot, Number(0)), Number(interior + 1)); };
    Number left[6], right[6];
    for (int d = 1; d < 6; ++d) {
        left[d] = x - inside(low + Number(1 - d));
        right[d] = inside(low + Number(d)) - x;
    }
    value[0] = Number(1);
    for (int d = 1; d < 6; ++d) {
        Number saved(0);
        for (int r = 0; r < d; ++r) {
            const Number share = value[r] / (right[r + 1] + left[d - r]);
            value[r] = saved + right[r + 1] * share;
            saved = left[d - r] * share;
        }
        value[d] = saved;
    }
}
inline std::array<double, 6> six_values_at(double x, int interior) {
    std::array<double, 6> out;
    six_values(x, double(span_of(x, interior)), interior, out.data());
    return out;
}

template <class T> struct span_table {
    std::vector<T> value[4];  // derivative 0: at the ends of all steps; 1 to 3: at the spans' looks; six a row
};

template <class T> span_table<T> make_span_table(int interior) {
    span_table<T> t;
    const int spans = interior + 1;
    for (int derivative = 0; derivative < (interior > most_tabled ? 4 : 1); ++derivative) {
        const int steps = derivative ? looks_a_span * spans : lengths_a_span * spans + 1;
        for (int i = 0; i < steps; ++i) {
            const double s = derivative ? (i + 0.5) / (looks_a_span * spans) : double(i) / (lengths_a_span * spans);
            double six[6];
            six_spline_values(s, interior, derivative, six);
            for (double b : six) t.value[derivative].push_back(static_cast<T>(b));
        }
    }
    return t;
}
template <class T> std::shared_ptr<const span_table<T>> span_table_of(int interior) {
    return kept_table<span_table<T>>(interior, make_span_table<T>);
}

// The control points of one motion: K + 6 rows, the start and the end three times each.
template <class T> class local_spline {
  public:
    static constexpr int W = lanes_of<T>;

    void take(const motion<T>& m, const T* start, const T* end, int n) {
        K_ = m.interior;
        n_ = n;
        stride_ = (n + W - 1) / W * W;
        rows_.assign(static_cast<std::size_t>(K_ + 6) * stride_, T(0));
        for (int k = 0; k < K_ + 6; ++k) {
            const T* from = k < 3 ? start : k < K_ + 3 ? &m.points[static_cast<std::size_t>(k - 3) * n] : end;
            std::copy(from, from + n, &rows_[static_cast<std::size_t>(k) * stride_]);
        }
        if (K_ >= static_cast<int>(tables_.size())) tables_.resize(K_ + 1);
        if (!tables_[K_]) tables_[K_] = span_table_of<T>(K_);
        table_ = tables_[K_].get();
        lanes_.resize(static_cast<std::size_t>(W) * stride_);
    }
    int interior() const { return K_; }
    int looks() const { return looks_a_span * (K_ + 1); }
    // A derivative per unit of s at one of the looks, the joints side by side in packs: `each` gets them one by one.
    template <class Each> void derivative(int order, int look, Each&& each) const {
        const T* six = &table_->value[order][static_cast<std::size_t>(look) * 6];
        const T* row = &rows_[static_cast<std::size_t>(look / looks_a_span) * stride_];
        for (int b = 0; b < stride_; b += W) each(b, summed(row + b, six, 1));
    }
    // The joints at a pack of positions.
    void joints(const T* position, pack<T>* q) {
        T low[W], lane[W];
        int span[W];
        for (int i = 0; i < W; ++i) {
            span[i] = span_of(position[i], K_);
            low[i] = static_cast<T>(span[i]);
        }
        pack<T> six[6];
        T value[6 * W];
        six_values(pack<T>::load(position), pack<T>::load(low), K_, six);
        for (int j = 0; j < 6; ++j) six[j].store(value + j * W);
        for (int i = 0; i < W; ++i) {
            const T* row = &rows_[static_cast<std::size_t>(span[i]) * stride_];
            for (int b = 0; b < stride_; b += W)
                summed(row + b, value + i, W).store(&lanes_[static_cast<std::size_t>(i) * stride_ + b]);
        }
        for (int d = 0; d < n_; ++d) {
            for (int i = 0; i < W; ++i) lane[i] = lanes_[static_cast<std::size_t>(i) * stride_ + d];
            q[d] = pack<T>::load(lane);
        }
    }

    // How long the motion is up to the end of each step, by the chords of the steps. Returns the whole.
    T measure_lengths() {
        const int steps = lengths_a_span * (K_ + 1);
        lengths_.resize(steps + 1);
        lengths_[0] = 0;
        T* before = lanes_.data();
        T* here = before + stride_;
        std::copy(rows_.begin(), rows_.begin() + stride_, before);
        for (int i = 1; i <= steps; ++i) {
            const T* six = &table_->value[0][static_cast<std::size_t>(i) * 6];
            const T* row = &rows_[static_cast<std::size_t>(span_of(i / lengths_a_span, K_)) * stride_];
            pack<T> squared(T(0));
            for (int b = 0; b < stride_; b += W) {
                const pack<T> at = summed(row + b, six, 1), away = at - pack<T>::load(before + b);
                at.store(here + b);
                squared += away * away;
            }
            lengths_[i] = lengths_[i - 1] + std::sqrt(sum_of(squared));
            std::swap(before, here);
        }
        return lengths_.back();
    }
    // The position at which a share of that length lies behind.
    T position_at(T share) const {
        const T wanted = share * lengths_.back();
        const auto next = std::upper_bound(lengths_.begin(), lengths_.end(), wanted);
        const int i = static_cast<int>(
            std::clamp<std::ptrdiff_t>(next - lengths_.begin(), 1, static_cast<std::ptrdiff_t>(lengths_.size()) - 1));
        const T step = lengths_[i] - lengths_[i - 1];
        const T part = step > T(0) ? std::clamp((wanted - lengths_[i - 1]) / step, T(0), T(1)) : T(0);
        return (T(i - 1) + part) / T(lengths_a_span);
    }

  private:
    // Six control points, each times its value.
    SPACEARM_INLINE pack<T> summed(const T* row, const T* six, int apart) const {
        pack<T> sum = pack<T>::load(row) * six[0];
        for (int j = 1; j < 6; ++j) sum += pack<T>::load(row + static_cast<std::size_t>(j) * stride_) * six[j * apart];
        return sum;
    }

    int K_ = 0, n_ = 0, stride_ = 0;
    std::vector<T> rows_, lanes_, lengths_;
    const span_table<T>* table_ = nullptr;
    std::vector<std::shared_ptr<const span_table<T>>> tables_;
};

}  // namespace SPACEARM_NAMESPACE
