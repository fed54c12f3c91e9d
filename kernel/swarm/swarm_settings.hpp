// What can be set about a swarm, and how two candidates compare.
#pragma once

#include <cstdint>

#include "checks.hpp"

namespace SPACEARM_NAMESPACE {

enum class swarm_variant { pso, symbiotic, cooperative, evolving };
enum class bounds_rule { absorb, reflect, periodic };
enum class constraint_rule { feasible_first, penalty };

// What the counters below, and the memory for a swarm's numbers, can bear.
inline constexpr int most_particles = 10'000'000, most_rounds = 1 << 30, most_power = 1000, most_entries = 1'000'000;
inline constexpr std::int64_t most_evaluations = std::int64_t(1) << 62;

struct swarm_settings {
    int particles = 300;
    std::int64_t evaluations = 30000;  // the budget: the length of every schedule below, and of a native run
    swarm_variant variant = swarm_variant::pso;
    double inertia_start = 0.5, inertia_end = 0.5;      // eq. (14)
    double cognitive = 2, social = 2, cooperation = 2;  // c1, c2, c3
    double velocity_clamp = 0;                          // share of each dimension's range; 0 leaves velocities free
    double start_velocity = 0.2;  // the first velocities are uniform in +- this share of the range
    int ring = 0;                 // neighbours to either side whose best is followed; 0: the population's best
    bounds_rule bounds = bounds_rule::absorb;
    constraint_rule constraints = constraint_rule::feasible_first;
    double penalty_start = 0, penalty_end = 0;  // penalty: fitness + weight * violation; constant until penalty_rise,
    double penalty_rise = 0;                    // then rising with the square of the share of the budget that is left
    double tolerance_share = 0;    // feasible first: this quantile of the first violations is forgiven at first,
    double tolerance_until = 0.8;  // none after this share of the budget
    int tolerance_power = 5;
    double evolving_share = 1;  // evolving: the share of the particles in population 3
    double elite_share = 0.11;  // evolving: population 3 steers towards one of this best share of its own
    int memory = 20;            // evolving: entries in the success history
    int shrink_to = 0;          // evolving: population 3 shrinks to this many as the budget is spent; 0: it stays
};

inline void require_sound(const swarm_settings& s) {
    constexpr const char* out = "settings of a swarm out of range";
    require(s.particles >= 1 && s.particles <= most_particles && s.memory >= 1 && s.memory <= most_entries, out);
    require(s.evaluations >= 1 && s.evaluations <= most_evaluations, "a budget out of range");
    for (double x : {s.inertia_start, s.inertia_end, s.cognitive, s.social, s.cooperation, s.velocity_clamp,
                     s.start_velocity, s.penalty_start, s.penalty_end, s.penalty_rise}) {
        require(within(x, most_weight), "a setting that is no number, or too large");
    }
    require(s.tolerance_power >= 0 && s.tolerance_power <= most_power && s.ring >= 0 && s.ring <= most_particles
                && s.shrink_to >= 0 && s.shrink_to <= most_particles,
            out);
    require(s.evolving_share > 0 && s.evolving_share <= 1 && s.elite_share > 0 && s.elite_share <= 1, out);
    require(s.tolerance_share >= 0 && s.tolerance_share <= 1 && s.tolerance_until > 0, out);
}

// A candidate's worth. Feasible first: less violation wins, then less fitness.
template <class T> struct merit {
    T violation, fitness;
    bool better_than(const merit& other) const {
        return violation < other.violation || (violation == other.violation && fitness < other.fitness);
    }
};

}  // namespace SPACEARM_NAMESPACE
