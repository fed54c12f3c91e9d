// Differential evolution with a success history (SHADE: Tanabe and Fukunaga 2013; the shrinking population of L-SHADE,
// 2014, is in swarm.hpp): the moves of a population that recombines personal bests instead of moving by velocity.
//
// A candidate is its parent, moved towards one of the elite and by the difference of two members drawn at random (which
// may coincide with it or each other, unlike in the papers: rare, and a draw less to repeat),
//   y = x + F (x_elite - x) + F (x_r1 - x_r2),
// and crossed with the parent: each coordinate is y's with probability CR. F and CR are drawn around values that have
// lately led to improvements. x_r2 may come from an archive of replaced parents.
#pragma once

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "lanes/random.hpp"

namespace SPACEARM_NAMESPACE {

template <class Better> std::vector<int> ranked_by(int from, int to, Better&& better) {
    std::vector<int> order(to - from);
    std::iota(order.begin(), order.end(), from);
    std::stable_sort(order.begin(), order.end(), better);
    return order;
}

// Puts the entries that `order` names, which follow one another from its least on, into that order.
template <class T> void reorder(T* row, const std::vector<int>& order) {
    std::vector<T> sorted;
    for (int i : order) sorted.push_back(row[i]);
    std::copy(sorted.begin(), sorted.end(), row + *std::min_element(order.begin(), order.end()));
}

template <class T> struct evolver {
    std::vector<T> factor, crossover;                    // the history
    std::vector<T> archive;                              // rows of replaced parents
    int next = 0;                                        // history entry to be written
    std::vector<T> drawn_factor, drawn_crossover, gain;  // of this round's candidates; gain 0: no improvement

    explicit evolver(int entries) : factor(entries, T(0.5)), crossover(entries, T(0.5)) {}

    static constexpr int most_draws = 1000;  // half of them are above 0, unless the history is not of our making

    void begin(int n) {
        drawn_factor.assign(n, T(0));
        drawn_crossover.assign(n, T(0));
        gain.assign(n, T(0));
    }

    // The candidate of member i of the n that begin at particle `from`, written to x.
    void propose(particle_sequence<T> draw, int i, int from, int n, const std::vector<int>& elite, const T* px,
                 int stride, const std::vector<T>& lower, const std::vector<T>& upper, T* x) {
        const int dims = static_cast<int>(lower.size());
        const int memory = draw.below(static_cast<int>(factor.size()));
        const T cr = std::min(std::max(crossover[memory] + T(0.1) * draw.bell(), T(0)), T(1));
        T f = factor[memory] + T(0.1) * draw.cauchy();
        for (int again = 0; f <= T(0) && again < most_draws; ++again) f = factor[memory] + T(0.1) * draw.cauchy();
        f = f > T(0) && f < T(1) ? f : T(1);
        drawn_factor[i] = f;
        drawn_crossover[i] = cr;
        const int best = elite[draw.below(static_cast<int>(elite.size()))];
        const int r1 = from + draw.below(n);
        const int archived = static_cast<int>(archive.size()) / dims;
        const int r2 = draw.below(n + archived);
        const int certain = draw.below(dims);
        for (int d = 0; d < dims; ++d) {
            const T* row = px + static_cast<std::size_t>(d) * stride;
            const T parent = row[from + i];
            const T other = r2 < n ? row[from + r2] : archive[static_cast<std::size_t>(r2 - n) * dims + d];
            T y = parent + f * (row[best] - parent) + f * (row[r1] - other);
            if (y < lower[d]) y = (lower[d] + parent) / T(2);
            if (y > upper[d]) y = (upper[d] + parent) / T(2);
            const bool crossed = draw.uniform() < cr || d == certain;
            x[static_cast<std::size_t>(d) * stride + from + i] = crossed ? y : parent;
        }
    }

    void succeeded(int i, T improvement) {
        gain[i] = std::isfinite(improvement) && improvement > T(0) ? improvement : T(1e-30);
    }

    // The parent that a better candidate replaces goes to the archive, over a random entry when that is full.
    void keep(const random_key& key, int round, int particle, const std::vector<T>& px, int stride, int dims,
              int most) {
        if (most <= 0) return;
        std::size_t slot = archive.size();
        if (static_cast<int>(archive.size()) / dims >= most) {
            particle_sequence<T> draw(key, {static_cast<std::uint32_t>(particle), static_cast<std::uint32_t>(round)});
            slot = static_cast<std::size_t>(draw.below(most)) * dims;
        } else {
            archive.resize(archive.size() + dims);
        }
        for (int d = 0; d < dims; ++d) archive[slot + d] = px[static_cast<std::size_t>(d) * stride + particle];
    }
    void trim(int dims, int most) {
        if (static_cast<int>(archive.size()) > most * dims) archive.resize(static_cast<std::size_t>(most) * dims);
    }

    // One entry of the history becomes the weighted means (Lehmer's for F) of what improved, weights by the gain.
    void learn() {
        T weights = 0, f1 = 0, f2 = 0, cr = 0;
        const T most = gain.empty() ? T(0) : *std::max_element(gain.begin(), gain.end());
        if (!(most > T(0))) return;
        int exponent = 0;
        std::frexp(most, &exponent);
        for (std::size_t i = 0; i < gain.size(); ++i) {
            const T g = std::ldexp(gain[i], -exponent);  // exact, and no sum overflows
            weights += g;
            f1 += g * drawn_factor[i];
            f2 += g * drawn_factor[i] * drawn_factor[i];
            cr += g * drawn_crossover[i];
        }
        if (!(weights > T(0)) || !(f1 > T(0))) return;
        factor[next] = f2 / f1;
        crossover[next] = cr / weights;
        next = (next + 1) % static_cast<int>(factor.size());
    }
};

}  // namespace SPACEARM_NAMESPACE
