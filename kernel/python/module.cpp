// The Python module of one instruction level.
#include "python/bind_convex.hpp"
#include "python/bind_exact.hpp"
#include "python/bind_inverse_kinematics.hpp"
#include "python/bind_model.hpp"
#include "python/bind_search.hpp"
#include "python/bind_swarm.hpp"

namespace SPACEARM_NAMESPACE {

// For the tests: what the random numbers and sines of packs are.
template <class T> void bind_lanes(nb::module_& m, const std::string& suffix) {
    m.def(("uniforms" + suffix).c_str(),
          [](std::uint64_t seed, std::uint32_t trial, std::uint32_t purpose, std::uint32_t iteration,
             std::uint32_t first, std::uint32_t block) {
              const uniform_block<T> drawn =
                  uniforms<T>(random_key(seed, trial, static_cast<stream>(purpose)), iteration, first, block);
              std::vector<T> out(4 * word_lanes);
              for (int i = 0; i < 4; ++i) {
                  for (int g = 0; g < packs_of_words<T>; ++g)
                      drawn.u[i][g].store(&out[i * word_lanes + g * lanes_of<T>]);
              }
              return array_of<T, 2>(std::move(out), {4, static_cast<std::size_t>(word_lanes)});
          },
          "seed"_a, "trial"_a, "purpose"_a, "iteration"_a, "first"_a, "block"_a);
    m.def(("sincos" + suffix).c_str(),
          [](in1<T> x) {
              std::vector<T> s(x.shape(0)), c(x.shape(0));
              for (std::size_t i = 0; i < s.size(); ++i) {
                  pack<T> sine, cosine;
                  sincos(pack<T>(x(i)), sine, cosine);
                  store_lanes(sine, &s[i], 1);
                  store_lanes(cosine, &c[i], 1);
              }
              return std::pair(row_of(std::move(s)), row_of(std::move(c)));
          },
          "x"_a);
}

template <class T> void bind_scalar(nb::module_& m, const std::string& suffix) {
    const auto named = [&](const char* name) { return std::string(name) + suffix; };
    bind_model<T>(m, named("Model").c_str());
    bind_result<T>(m, named("TrialResult").c_str());
    bind_objectives<T>(m, named("PaperObjective").c_str(), named("ReachObjective").c_str());
    bind_steps<T>(m, named("Swarm").c_str());
    bind_motion_search<T>(m, suffix);
    bind_lanes<T>(m, suffix);
}

NB_MODULE(SPACEARM_MODULE, m) {
    m.doc() = "The native kernel, one build an instruction level.";
    bind_world(m);
    bind_swarm_settings(m);
    bind_search_settings(m);
    bind_weights(m);
    bind_demands(m);
    bind_request(m);
    bind_scalar<double>(m, "64");
    bind_scalar<float>(m, "32");
    bind_goal_search<double>(m, "64");
    bind_exact(m);
    bind_convex(m);
    m.def("spline_values", &spline_values, "s"_a, "interior"_a, "derivative"_a);
    m.attr("level") = SPACEARM_LEVEL_NAME;
    m.attr("lanes32") = lanes_of<float>;
    m.attr("lanes64") = lanes_of<double>;
#if defined(__clang__)
    m.attr("compiler") = "clang " __clang_version__;
#else
    m.attr("compiler") = "gcc " __VERSION__;
#endif
}

}  // namespace SPACEARM_NAMESPACE
