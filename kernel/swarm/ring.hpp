// Whom particles on a ring follow: the best of themselves and of k to either side; of equals themselves, else the first
// from the far end on.
#pragma once

#include <vector>

#include "lanes/lanes.hpp"

namespace SPACEARM_NAMESPACE {

// The same for many neighbours, in time that hardly depends on how many: the best of 1, 2, 4, ... in a row, until two
// such rows make the whole neighbourhood.
template <class Better> void follow_many(int size, int k, Better&& better, std::vector<int>& guide) {
    const int width = 2 * k + 1, all = size + width - 1;  // the ring, cut open k before its first
    std::vector<int> best(all);
    for (int i = 0; i < all; ++i) best[i] = (i + size - k) % size;
    int reach = 1;
    for (; 2 * reach <= width; reach *= 2) {
        for (int i = 0; i + 2 * reach <= all; ++i) {
            if (better(best[i + reach], best[i])) best[i] = best[i + reach];
        }
    }
    for (int i = 0; i < size; ++i) {
        const int first = best[i], last = best[i + width - reach], of_all = better(last, first) ? last : first;
        guide[i] = better(of_all, i) ? of_all : i;
    }
}

// guide: for each of `size` particles, which of them; 2 k + 1 is less than the size. better(i, j): whether i is better
// than j.
template <class Better> void follow_ring(int size, int k, Better&& better, std::vector<int>& guide) {
    constexpr int many = 32;  // from here on doubling is quicker
    if (k > many) return follow_many(size, k, better, guide);
    for (int i = 0; i < size; ++i) {
        int best = i;
        for (int o = -k; o <= k; ++o) {
            const int other = i + o < 0 ? i + o + size : i + o >= size ? i + o - size : i + o;
            if (better(other, best)) best = other;
        }
        guide[i] = best;
    }
}

}  // namespace SPACEARM_NAMESPACE
