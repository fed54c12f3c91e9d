// One of VAMP's robots on problems from stdin: RRT-Connect with simplification, and AORRTC with growing budgets of iterations.
//
//     program repetitions range dynamic_domain [budget ...]      compiled with -DROBOT=Panda -DROBOT_FILE="<vamp/robots/panda.hh>"
//
// The names of the robot's joints are told first, in a line: their order is that of the configurations here.
// A problem: the start and the goal; the number of boxes, then centre, three axes and half sizes of each (15 numbers); the
// number of capsules, then both ends and the radius of each (7 numbers); the number of spheres, then centre and radius of each.
// For each problem a line "ends start_free goal_free", then lines
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
#include ROBOT_FILE

namespace {

using Robot = vamp::robots::ROBOT;
constexpr std::size_t rake = vamp::FloatVectorWidth;
using Input = vamp::collision::Environment<float>;
using Vectorised = vamp::collision::Environment<vamp::FloatVector<rake>>;
using Path = vamp::planning::Path<Robot>;

struct Found {
    double seconds = 0;
    Path path;
};

Found found(const vamp::planning::PlanningResult<Robot>& result) { return {1e-9 * static_cast<double>(result.nanoseconds), result.path}; }

constexpr double enough = 0.3;    // seconds after which a run is not repeated
constexpr double patience = 2.0;  // seconds after which a run that found nothing is not made longer

template <class Plan> Found least_of(int repetitions, Plan plan) {
    Found out = plan();
    for (int i = 1; i < repetitions && out.seconds < enough; ++i) {
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
    std::cin >> count;
    for (int i = 0; i < count; ++i) {
        float x[4];
        for (float& number : x) std::cin >> number;
        out.spheres.push_back(vamp::collision::factory::sphere::flat(x[0], x[1], x[2], x[3]));
    }
    out.sort();
    return out;
}

bool is_free(const Robot::Configuration& q, const Vectorised& environment) {
    return vamp::planning::validate_motion<Robot, rake, 1>(q, q, environment);
}

}  // namespace

int main(int argc, char** argv) {
    const int repetitions = argc > 1 ? std::atoi(argv[1]) : 3;
    const float range = argc > 2 ? static_cast<float>(std::atof(argv[2])) : 1.0f;
    std::vector<std::size_t> budgets;
    const bool dynamic_domain = argc <= 3 || std::atoi(argv[3]) != 0;
    for (int i = 4; i < argc; ++i) budgets.push_back(std::strtoul(argv[i], nullptr, 10));
    for (const auto& name : Robot::joint_names) std::printf("%.*s ", static_cast<int>(name.size()), name.data());
    std::printf("\n");
    std::fflush(stdout);
    Robot::ConfigurationArray from, to;
    while (read(from) && read(to)) {
        const Vectorised environment(read_environment());
        const Robot::Configuration start(from), goal(to);
        std::printf("ends %d %d\n", is_free(start, environment), is_free(goal, environment));
        const vamp::planning::SimplifySettings simplification;
        const auto rough = [&](const auto& rng) {
            Found out;
            // The same run with ten times the iterations, where the first ones did not do: it ends sooner where they did.
            for (const std::size_t most : {100'000, 1'000'000}) {
                vamp::planning::RRTCSettings settings;
                settings.range = range;
                settings.dynamic_domain = dynamic_domain;
                settings.max_iterations = settings.max_samples = most;
                rng->reset();
                out = found(vamp::planning::RRTC<Robot, rake, Robot::resolution>::solve(start, goal, environment, settings, rng));
                if (!out.path.empty() || out.seconds > patience) break;
            }
            return out;
        };
        tell("RRTC", 0, least_of(repetitions, [&] { return rough(std::make_shared<vamp::rng::Halton<Robot>>()); }));
        tell("RRTC+simplify", 0, least_of(repetitions, [&] {
            const auto rng = std::make_shared<vamp::rng::Halton<Robot>>();
            const Found corners = rough(rng);
            if (corners.path.empty()) return corners;
            Found out = found(vamp::planning::simplify<Robot, rake, Robot::resolution>(corners.path, environment, simplification, rng));
            out.seconds += corners.seconds;
            return out;
        }));
        for (const std::size_t budget : budgets) {
            vamp::planning::AORRTCSettings anytime;
            anytime.rrtc.range = range;
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
