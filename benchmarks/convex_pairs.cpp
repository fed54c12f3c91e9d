// The distance of two convex shapes, without Python: 64 packs of random poses of each pair. Prints nanoseconds of the
// thread's time a configuration, float, least of 9 rounds, far apart (all beyond `enough`), near, and overlapping.
//
//   g++ -std=c++20 -O3 -march=x86-64-v4 -DSPACEARM_LEVEL=4 -DSPACEARM_NAMESPACE=pairs -fno-tree-slp-vectorize
//       -fno-math-errno -fno-trapping-math -ffp-contract=off -Wno-psabi -Ikernel benchmarks/convex_pairs.cpp -o pairs
#include <cstdio>
#include <ctime>
#include <random>

#include "geometry/obstacles.hpp"

namespace SPACEARM_NAMESPACE {

constexpr int packs = 64, rounds = 9;

struct named_shape {
    const char* name;
    convex_shape<float> shape;
};

// 30 points on an ellipsoid.
const float (*rock())[3] {
    static float vertices[30][3];
    std::mt19937 random(5);
    std::normal_distribution<double> normal;
    const double half[3] = {0.3, 0.2, 0.25};
    for (auto& vertex : vertices) {
        double p[3], squared = 0;
        for (double& x : p) {
            x = normal(random);
            squared += x * x;
        }
        for (int k = 0; k < 3; ++k) vertex[k] = float(half[k] * p[k] / std::sqrt(squared));
    }
    return vertices;
}

// A pack of poses: any rotations, `away` [m] from the origin in any direction.
placed_shape<float> drawn(const convex_shape<float>& shape, double away, std::mt19937& random) {
    std::normal_distribution<double> normal;
    float entry[4][3][lanes_of<float>];
    for (int i = 0; i < lanes_of<float>; ++i) {
        double w = normal(random), x = normal(random), y = normal(random), z = normal(random), d[3], squared = 0;
        const double size = std::sqrt(w * w + x * x + y * y + z * z);
        w /= size, x /= size, y /= size, z /= size;
        const double columns[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)},
                                      {2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)},
                                      {2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)}};
        for (double& each : d) {
            each = normal(random);
            squared += each * each;
        }
        for (int r = 0; r < 3; ++r) {
            for (int c = 0; c < 3; ++c) entry[c][r][i] = float(columns[c][r]);
            entry[3][r][i] = float(away * d[r] / std::sqrt(squared));
        }
    }
    const auto column = [&](int c) {
        return vec3<float>{pack<float>::load(entry[c][0]), pack<float>::load(entry[c][1]),
                           pack<float>::load(entry[c][2])};
    };
    return {&shape, {column(0), column(1), column(2)}, column(3)};
}

double thread_nanoseconds() {
    timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return double(now.tv_sec) * 1e9 + double(now.tv_nsec);
}

double measure(const convex_shape<float>& a, const convex_shape<float>& b, double away, bool depth) {
    constexpr float enough = 0.05f;
    std::mt19937 random(7);
    std::vector<placed_shape<float>> first, second;
    for (int i = 0; i < packs; ++i) {
        first.push_back(drawn(a, 0, random));
        second.push_back(drawn(b, away, random));
    }
    double least = 1e9;
    float kept = 0;
    for (int round = 0; round < rounds; ++round) {
        const double begin = thread_nanoseconds();
        for (int i = 0; i < packs; ++i) kept += sum_of(signed_distance(first[i], second[i], enough, depth));
        least = std::min(least, (thread_nanoseconds() - begin) / (packs * lanes_of<float>));
    }
    return kept == 12345 ? 0 : least;  // so that nothing is left out
}

void print_all() {
    using enum core_kind;
    const named_shape shapes[] = {{"capsule", {segment, {0, 0, 0.3f}, 0.05f, 0, nullptr}},
                                  {"box", {box, {0.3f, 0.25f, 0.2f}, 0, 0, nullptr}},
                                  {"cylinder", {cylinder, {0.2f, 0.2f, 0.3f}, 0, 0, nullptr}},
                                  {"polytope", {polytope, {}, 0, 30, rock()}}};
    std::printf("%-20s %8s %8s %12s %16s\n", "ns", "far", "near", "overlapping", "with the depth");
    for (int i = 0; i < 4; ++i) {
        for (int k = i; k < 4; ++k) {
            const auto ns = [&](double away, bool depth) {
                return measure(shapes[i].shape, shapes[k].shape, away, depth);
            };
            std::printf("%-9s%-11s %8.1f %8.1f %12.1f %16.1f\n", shapes[i].name, shapes[k].name, ns(2.0, false),
                        ns(0.5, false), ns(0.1, false), ns(0.1, true));
        }
    }
}

}  // namespace SPACEARM_NAMESPACE

int main() { SPACEARM_NAMESPACE::print_all(); }
