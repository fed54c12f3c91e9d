// The kernel's inner loop alone, for build_choices.py: the paper's objective on 1,024 packs, so many that the processor
// cannot learn which of them come near an obstacle, and the randomness. Prints nanoseconds a configuration and a random
// number, double then float, least of 40 rounds.
#include <chrono>
#include <cmath>
#include <cstdio>

#include "lanes/random.hpp"
#include "swarm/objectives.hpp"

namespace SPACEARM_NAMESPACE {

// The paper's arm (joint axes z, x, y, z, y, x, z at q = 0, links along +y) among its three spheres.
template <class T> paper_objective<T> paper_example() {
    const double along[3][9] = {{0, 0, 1, 1, 0, 0, 0, 1, 0}, {0, 1, 0, 0, 0, 1, 1, 0, 0}, {1, 0, 0, 0, 1, 0, 0, 0, 1}};
    const char axes[] = "zxyzyxz";
    const double link_before[7] = {0, 0, 0, 0.668, 0.4128, 0, 0};
    paper_objective<T> o;
    const double* before = along[2];
    for (int j = 0; j < 7; ++j) {
        const double* now = along[axes[j] - 'x'];
        double rotation[9] = {}, translation[3];
        for (int r = 0; r < 3; ++r) {
            translation[r] = before[3 + r] * link_before[j];
            for (int c = 0; c < 3; ++c) {
                for (int k = 0; k < 3; ++k) rotation[3 * r + c] += before[3 * k + r] * now[3 * k + c];
            }
        }
        o.scene.robot.joints.push_back(make_joint<T>(j - 1, joint_kind::revolute, j, 1, 0, rotation, translation));
        before = now;
    }
    o.scene.robot.dofs = 7;
    o.scene.points = {{-1, {0, 0, 0}}, {3, {0, 0, 0}}, {4, {0, 0, 0}}, {6, {0, T(0.2552), 0}}};
    mark_needed(o.scene.robot, {0, 0, 0, 0, 0, 0, 2});
    const double length[3] = {0.668, 0.4128, 0.2552}, centre[3][2] = {{0.5, 0.5}, {0.4, 0.7}, {0.2, 0.8}};
    for (int i = 0; i < 3; ++i) {
        o.scene.capsules.push_back({i, i + 1, T(0), T(1 / (length[i] * length[i]))});
        o.scene.spheres.push_back({{T(centre[i][0]), T(centre[i][1]), T(0)}, T(0.1)});
        o.f1_at_rest += std::sqrt(T(centre[i][0] * centre[i][0] + centre[i][1] * centre[i][1]));
    }
    o.centers = {1, 2, 3};
    o.tip = 3;
    o.goal[0] = T(0.7), o.goal[1] = T(0.3);
    o.weight[0] = T(0.5), o.weight[1] = o.weight[2] = T(0.25);
    o.tolerance = T(1e-3);
    return o;
}

// Every lane counts: without this the compiler leaves out the lanes that nobody reads.
template <class T> SPACEARM_INLINE void keep(const pack<T>& p) {
    T lane[lanes_of<T>];
    p.store(lane);
    asm volatile("" : : "r"(lane) : "memory");
}

template <class F> double least_seconds(F&& work) {
    double best = 1e9;
    for (int round = 0; round < 40; ++round) {
        const auto begun = std::chrono::steady_clock::now();
        work();
        best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count());
    }
    return best;
}

template <class T> void report() {
    constexpr int packs = 1024, times = 3, draws = 1000;
    const auto o = paper_example<T>();
    auto w = o.make_workspace();
    const random_key key(1, 0, stream::start_position);
    std::vector<pack<T>> q(packs * 8);
    for (int i = 0; i < packs * 2; ++i) {
        const auto block = uniforms<T>(key, 0, static_cast<std::uint32_t>(i) * word_lanes, 0);
        for (int k = 0; k < 4; ++k) q[i * 4 + k] = (block.u[k][0] - T(0.5)) * T(5);
    }
    const double objective = least_seconds([&] {
        for (int t = 0; t < times; ++t) {
            for (int i = 0; i < packs; ++i) {
                pack<T> f, c;
                o(&q[i * 8], w, f, c);
                keep(f + c);
            }
        }
    });
    const double randomness = least_seconds([&] {
        for (std::uint32_t t = 0; t < draws; ++t) {
            const auto block = uniforms<T>(key, t, 0, 0);
            for (int g = 0; g < packs_of_words<T>; ++g) {
                for (int i = 0; i < 4; ++i) keep(block.u[i][g]);
            }
        }
    });
    std::printf("%.3f %.3f\n", objective * 1e9 / (times * packs * lanes_of<T>),
                randomness * 1e9 / (4 * draws * word_lanes));
}

}  // namespace SPACEARM_NAMESPACE

int main() {
    SPACEARM_NAMESPACE::report<double>();
    SPACEARM_NAMESPACE::report<float>();
}
