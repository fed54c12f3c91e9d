// How the planner searches, when it ends, and what it keeps of what it found.
#pragma once

#include "search/rrt_connect.hpp"
#include "swarm/swarm.hpp"

namespace SPACEARM_NAMESPACE {

struct motion_search_settings {
    swarm_settings swarm;  // evaluations: of one turn
    rrt_connect_settings trees;
    std::vector<int> interior = {2, 3};                        // control points of the swarm's motions, turn by turn
    std::vector<int> ladder = {1, 2, 3, 4, 6, 8, 12, 16, 24};  // tried on a path, in this order
    int patience = 4000;        // samples of the trees before the swarm gets a turn; 0: no trees
    int refine_stall = 100;     // refining ends after as many failures in a row
    int swarm_turn = 3;         // the swarm's is every turn of this number; 0: none
    int swarm_stall = 20;       // rounds without improvement that end its turn
    double give_up = 1.15;      // refining ends early where a motion stays this much worse than the best
    double detour = 1.3;        // paths longer than this times the best motion are not followed up
    double shake = 0.3;         // first deviation of refining [rad or m]
    double swarm_spread = 0.4;  // of the particles around the motions known
};

struct motion_budget {
    std::int64_t evaluations = 0;  // 0: no limit
    double seconds = 0;            // 0: no limit
    bool until_first = false;
    std::int64_t stall = 0;  // end after so many evaluations without a motion, or an improvement of 0.1 %; 0: never
};

template <class T> struct motion_record {
    double seconds = 0;
    std::int64_t evaluations = 0;
    T fitness = 0;
    const char* by = "";
    motion<T> found;
};

}  // namespace SPACEARM_NAMESPACE
