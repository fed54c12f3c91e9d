// Counter-based randomness: Threefry-4x32 with 20 rounds (Salmon, Moraes, Dror and Shaw, "Parallel random numbers: as
// easy as 1, 2, 3", SC 2011). A number is a pure function of (seed, trial, iteration, particle, block), so a run gives
// the same bits on one or many threads and in packs of any width, and its state is a few integers.
#pragma once

#include <algorithm>
#include <array>

#include "lanes/lanes.hpp"

namespace SPACEARM_NAMESPACE {

// What a number is drawn for; a key of its own for each keeps the streams apart.
enum class stream : std::uint32_t {
    start_position = 0,
    start_velocity = 1,
    velocity = 2,
    evolution = 3,
    archive = 4,
    rrt_connect = 5,
    refining = 6,
    goal_guesses = 7
};

struct random_key {
    std::uint32_t word[4];
    random_key(std::uint64_t seed, std::uint32_t trial, stream purpose)
        : word{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32), trial,
               static_cast<std::uint32_t>(purpose)} {}
};

// W is a word or a vector of words; x holds the counter and becomes the four random words.
template <class W> SPACEARM_INLINE void threefry4x32(const random_key& key, W (&x)[4]) {
    const std::uint32_t k[5] = {key.word[0], key.word[1], key.word[2], key.word[3],
                                0x1BD11BDAu ^ key.word[0] ^ key.word[1] ^ key.word[2] ^ key.word[3]};
    for (int i = 0; i < 4; ++i) x[i] += k[i];
    auto mix01 = [&]<int R0, int R1>() {
        x[0] += x[1];
        x[1] = rotate_left<R0>(x[1]) ^ x[0];
        x[2] += x[3];
        x[3] = rotate_left<R1>(x[3]) ^ x[2];
    };
    auto mix03 = [&]<int R0, int R1>() {
        x[0] += x[3];
        x[3] = rotate_left<R0>(x[3]) ^ x[0];
        x[2] += x[1];
        x[1] = rotate_left<R1>(x[1]) ^ x[2];
    };
    auto inject = [&](std::uint32_t round) {
        for (std::uint32_t i = 0; i < 4; ++i) x[i] += k[(round + i) % 5];
        x[3] += round;
    };
    auto even = [&] {
        mix01.template operator()<10, 26>();
        mix03.template operator()<11, 21>();
        mix01.template operator()<13, 27>();
        mix03.template operator()<23, 5>();
    };
    auto odd = [&] {
        mix01.template operator()<6, 20>();
        mix03.template operator()<17, 11>();
        mix01.template operator()<25, 10>();
        mix03.template operator()<18, 20>();
    };
    even();
    inject(1);
    odd();
    inject(2);
    even();
    inject(3);
    odd();
    inject(4);
    even();
    inject(5);
}

// 0, 1, 2, ...
inline constexpr auto lane_numbers = [] {
    std::array<std::uint32_t, word_lanes> out{};
    for (int i = 0; i < word_lanes; ++i) out[i] = static_cast<std::uint32_t>(i);
    return out;
}();

// Uniforms in [0, 1) for the word_lanes particles first, first + 1, ... of one iteration: four numbers a particle, each
// as the packs it fills.
template <class T> struct uniform_block {
    pack<T> u[4][packs_of_words<T>];
};
template <class T>
SPACEARM_INLINE uniform_block<T> uniforms(const random_key& key, std::uint32_t iteration, std::uint32_t first,
                                          std::uint32_t block) {
    words lanes;
    std::memcpy(&lanes, lane_numbers.data(), sizeof lanes);
    words x[4] = {lanes + first, words{} + iteration, words{} + block, words{}};
    threefry4x32(key, x);
    uniform_block<T> out;
    for (int i = 0; i < 4; ++i) uniform(x[i], out.u[i]);
    return out;
}

// The same numbers one particle at a time, for moves that are not done on packs.
template <class T>
inline void uniforms_one(const random_key& key, std::uint32_t iteration, std::uint32_t particle, std::uint32_t block,
                         T (&out)[4]) {
    std::uint32_t x[4] = {particle, iteration, block, 0};
    threefry4x32(key, x);
    for (int i = 0; i < 4; ++i) {
        if constexpr (sizeof(T) == 4) out[i] = static_cast<T>(x[i] >> 8) * T(0x1p-24);
        else out[i] = static_cast<T>(x[i]) * T(0x1p-32);
    }
}

// Where a number stands: the counter that the key turns into random words.
struct random_counter {
    std::uint32_t particle = 0, round = 0, block = 0;
};

// The same numbers one after the other, Lanes counters at a time; `Next` is the part of the counter that goes on.
template <class T, int Lanes, std::uint32_t random_counter::* Next> class random_sequence {
    static_assert(Lanes == 1 || Lanes == word_lanes);

  public:
    random_sequence(const random_key& key, const random_counter& at) : key_(key), at_(at) {}

    T uniform() {
        if (next_ == buffered) refill();
        return values_[next_++];
    }
    int below(int n) { return std::min(n - 1, static_cast<int>(uniform() * static_cast<T>(n))); }

    // Bell-shaped with mean 0 and deviation 1: four uniforms summed. No logarithm, so the same bits everywhere.
    T bell() {
        T sum = uniform();  // one after the other: a sum's order is the compiler's to choose
        sum += uniform();
        sum += uniform();
        sum += uniform();
        return (sum - T(2)) * T(1.7320508075688772);
    }

    // Cauchy: the ratio of the coordinates of a point drawn in the half disc.
    T cauchy() {
        for (;;) {
            const T a = T(2) * uniform() - T(1), b = uniform();
            if (a * a + b * b <= T(1) && b > T(0)) return a / b;
        }
    }

  private:
    static constexpr int buffered = 4 * Lanes;
    void refill() {
        if constexpr (Lanes == 1) uniforms_one<T>(key_, at_.round, at_.particle, at_.block, values_);
        else {
            const uniform_block<T> block = uniforms<T>(key_, at_.round, at_.particle, at_.block);
            for (int i = 0; i < 4; ++i) {
                for (int g = 0; g < packs_of_words<T>; ++g)
                    block.u[i][g].store(&values_[i * word_lanes + g * lanes_of<T>]);
            }
        }
        ++(at_.*Next);
        next_ = 0;
    }

    random_key key_;
    random_counter at_;
    int next_ = buffered;
    T values_[buffered] = {};
};
// Of one particle in one round, for moves that are not done on packs.
template <class T> using particle_sequence = random_sequence<T, 1, &random_counter::block>;
// Of a whole search, many numbers.
template <class T> using search_sequence = random_sequence<T, word_lanes, &random_counter::round>;

}  // namespace SPACEARM_NAMESPACE
