// VAMP's Panda on problems from stdin: RRT-Connect with simplification, and AORRTC with growing budgets of iterations.
//
// A problem: seven numbers each for start and goal; the number of boxes, then centre, three axes and half sizes of each (15
// numbers); the number of capsules, then both ends and the radius of each (7 numbers). For each problem, lines
//     planner iterations solved seconds cost waypoints q q q ...
// and an empty line. Seconds are the planner's own, the least of a few repetitions; it draws from a Halton
// sequence, so that they are repetitions of the same run.
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <vector>

#include <vamp/collision/factory.hh>
#include <vamp/planning/aorrtc.hh>
#include <vamp/planning/rrtc.hh>
#include <vamp/planning/simplify.hh>
#include <vamp/planning/validate.hh>
#include <vamp/random/halton.hh>
#include <vamp/robots/panda.hh>

namespace {

using Robot = vamp::robots::Panda;
constexpr std::size_t rake = vamp::FloatVectorWidth;
using Input = vamp::collision::Environment<float>;
using Vectorised = vamp::collision::Environment<vamp::FloatVector<rake>>;
using Path = vamp::planning::Path<Robot>;

struct Found {
    double seconds = 0;
    Path path;
};

Found found(const vamp::planning::PlanningResult<Robot>& result) { return {1e-9 * static_cast<double>(result.nanoseconds), result.path}; }

template <class Plan> Found least_of(int repetitions, Plan plan) {
    Found out = plan();
    for (int i = 1; i < repetitions; ++i) {
        const Found again = plan();
        if (again.seconds < out.seconds) out = again;
    }
    return out;
}

void tell(const char* planner, std::size_t iterations, const Found& found) {
    std::printf("%s %zu %d %.9f %.6f %zu", planner, iterations, !found.path.empty(), found.seconds,
                found.path.empty() ? 0.0 : found.path.cost(), found.path.size());
    for (const auto& configuration : found.path) {
        const auto q = configuration.to_array();
        for (std::size_t i = 0; i < Robot::dimension; ++i) std::printf(" %.7g", q[i]);
    }
    std::printf("\n");
}

bool read(Robot::ConfigurationArray& q) {
    for (std::size_t i = 0; i < Robot::dimension; ++i) {
        if (!(std::cin >> q[i])) return false;
    }
    return true;
}

Input read_environment() {
    Input out;
    int count = 0;
    std::cin >> count;
    for (int i = 0; i < count; ++i) {
        float x[15];
        for (float& number : x) std::cin >> number;
        vamp::collision::Cuboid<float> box(x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8], x[9], x[10], x[11], x[12], x[13], x[14]);
        (box.axis_3_z == 1.f ? out.z_aligned_cuboids : out.cuboids).push_back(box);
    }
    std::cin >> count;
    for (int i = 0; i < count; ++i) {
        float x[7];
        for (float& number : x) std::cin >> number;
        const auto capsule = vamp::collision::factory::capsule::endpoints::flat(x[0], x[1], x[2], x[3], x[4], x[5], x[6]);
        (capsule.xv == 0.f && capsule.yv == 0.f ? out.z_aligned_capsules : out.capsules).push_back(capsule);
    }
    out.sort();
    return out;
}

}  // namespace

int main(int argc, char** argv) {
    const int repetitions = argc > 1 ? std::atoi(argv[1]) : 3;
    std::vector<std::size_t> budgets;
    for (int i = 2; i < argc; ++i) budgets.push_back(std::strtoul(argv[i], nullptr, 10));
    Robot::ConfigurationArray from, to;
    while (read(from) && read(to)) {
        const Vectorised environment(read_environment());
        const Robot::Configuration start(from), goal(to);
        vamp::planning::RRTCSettings settings;
        settings.range = 1.0;   // VAMP's own choice for the Panda
        settings.max_iterations = settings.max_samples = 1'000'000;
        const vamp::planning::SimplifySettings simplification;
        tell("RRTC", 0, least_of(repetitions, [&] {
            const auto rng = std::make_shared<vamp::rng::Halton<Robot>>();
            return found(vamp::planning::RRTC<Robot, rake, Robot::resolution>::solve(start, goal, environment, settings, rng));
        }));
        tell("RRTC+simplify", 0, least_of(repetitions, [&] {
            const auto rng = std::make_shared<vamp::rng::Halton<Robot>>();
            const Found rough = found(vamp::planning::RRTC<Robot, rake, Robot::resolution>::solve(start, goal, environment, settings, rng));
            if (rough.path.empty()) return rough;
            Found out = found(vamp::planning::simplify<Robot, rake, Robot::resolution>(rough.path, environment, simplification, rng));
            out.seconds += rough.seconds;
            return out;
        }));
        for (const std::size_t budget : budgets) {
            vamp::planning::AORRTCSettings anytime;
            anytime.rrtc.range = 1.0;
            anytime.max_iterations = anytime.max_samples = budget;
            tell("AORRTC", budget, least_of(repetitions, [&] {
                const auto rng = std::make_shared<vamp::rng::Halton<Robot>>();
                return found(vamp::planning::AORRTC<Robot, rake, Robot::resolution>::solve(start, goal, environment, anytime, rng));
            }));
        }
        std::printf("\n");
        std::fflush(stdout);
    }
}
