// How the planner searches, when it ends, and what it keeps of what it found.
#pragma once

#include "search/path_motions.hpp"
#include "swarm/swarm.hpp"

namespace SPACEARM_NAMESPACE {

// A user sets `swarm` and `interior`. The other numbers are constants of the search, the same for all robots. They were
// chosen on half of the problems of MotionBenchMaker for four arms; benchmarks/search_parts.py tells what each part
// of the search is worth.
struct motion_search_settings {
    swarm_settings swarm;  // evaluations: of one turn
    rrt_connect_settings trees;
    std::vector<int> interior = {2, 3};  // control points of the swarm's motions, turn by turn
    // Control points fitted to a path, in this order; after the first number its corners are rounded instead.
    std::vector<int> ladder = {2, 4, 8, 16};
    int patience = 4000;        // samples of the trees in a turn, once a motion is known; 0: no trees
    int first_turn = 1 << 19;   // configurations of the trees' first turn while none is known; twice as many each time
    double swarm_share = 0.08;  // of the trees' configurations, for the swarm, while none is known
    int shortcuts = 200;        // tried on a path in a turn, at most
    int shortcut_stall = 50;    // failures in a row that end the turn
    int refine_stall = 100;     // failures in a row that end refining
    int swarm_every = 3;        // where the end is constrained, one turn in so many is the swarm's; 0: no swarm at all
    int swarm_stall = 20;       // rounds without improvement that end its turn
    double give_up = 1.15;      // times the best fitness: motions that stay worse are not refined to the end
    double detour = 1.3;        // times the best fitness: longer paths are not followed
    double shake = 0.3;         // first deviation of refining [rad or m]
    double swarm_spread = 0.4;  // greatest deviation of the particles around the motions known [rad or m]
};

inline void require_sound(const motion_search_settings& s) {
    constexpr const char* out = "settings of a search out of range";
    require_sound(s.swarm);
    require(!s.interior.empty() && !s.ladder.empty(), "no number of control points");
    for (const auto* list : {&s.interior, &s.ladder}) {
        require(list->size() <= 1000, "too many numbers of control points");
        for (int k : *list) require(k >= 1 && k <= most_interior, "a number of control points out of range");
    }
    constexpr int often = 1'000'000;
    const auto counted = [](int n, int least) { return n >= least && n <= often; };
    require(s.trees.step >= 1e-3 && s.trees.step <= 1e3 && counted(s.patience, 0) && counted(s.swarm_every, 0)
                && counted(s.first_turn, 1) && counted(s.shortcuts, 1) && counted(s.shortcut_stall, 1)
                && counted(s.swarm_stall, 0) && counted(s.refine_stall, 1),
            out);
    for (double x : {s.trees.near_line, s.trees.spread, s.swarm_share, s.give_up, s.detour, s.shake, s.swarm_spread})
        require(x >= 0 && x <= 1e6, out);
}

struct motion_budget {
    std::int64_t evaluations = 0;  // 0: no limit
    double seconds = 0;            // 0: no limit
    bool until_first = false;
    std::int64_t stall = 0;  // end after this many evaluations without a motion, or an improvement of 0.1 %; 0: never
};

template <class T> struct motion_record {
    double seconds = 0;
    std::int64_t evaluations = 0;
    T fitness = 0;
    const char* by = "";
    motion<T> found;
};

}  // namespace SPACEARM_NAMESPACE
