// Translation between Python's arrays and the kernel's types; no idea of its own.
#include <chrono>

#include "python/exact.hpp"
#include "python/model.hpp"
#include "python/motion_search.hpp"
#include "swarm/objectives.hpp"
#include "swarm/trials.hpp"

namespace SPACEARM_NAMESPACE {

template <class T, class Objective> nb::object evaluate(const Objective& objective, in2<T> x) {
    require(static_cast<int>(x.shape(1)) == objective.dims(), "wrong number of dimensions");
    const std::size_t rows = x.shape(0);
    std::vector<T> f(rows), c(rows);
    auto w = objective.make_workspace();
    {
        nb::gil_scoped_release free;
        for_packs<T>(x, [&](std::size_t first, std::size_t filled, const pack<T>* packs) {
            pack<T> fitness, violation;
            objective(packs, w, fitness, violation);
            store_lanes(fitness, &f[first], filled);
            store_lanes(violation, &c[first], filled);
        });
    }
    return nb::make_tuple(array_of(std::move(f), {rows}), array_of(std::move(c), {rows}));
}

template <class T> nb::object paper_terms(const paper_objective<T>& objective, in2<T> q) {
    require(static_cast<int>(q.shape(1)) == objective.dims(), "wrong number of dimensions");
    const std::size_t rows = q.shape(0);
    std::vector<T> out(rows * 3);
    auto w = objective.make_workspace();
    {
        nb::gil_scoped_release free;
        for_packs<T>(q, [&](std::size_t first, std::size_t filled, const pack<T>* packs) {
            pack<T> fitness, violation, terms[3];
            objective(packs, w, fitness, violation, terms);
            for (int k = 0; k < 3; ++k) store_lanes(terms[k], &out[first * 3 + k], filled, 3);
        });
    }
    return array_of(std::move(out), {rows, 3});
}

template <class T> struct box {
    std::vector<T> lower, upper;
};
template <class T> box<T> box_of(const in1<double>& lower, const in1<double>& upper) {
    require(lower.shape(0) == upper.shape(0) && lower.shape(0) >= 1 && lower.shape(0) <= (1u << 24),
            "bounds of different lengths, or of none");
    box<T> out{std::vector<T>(lower.data(), lower.data() + lower.shape(0)),
               std::vector<T>(upper.data(), upper.data() + upper.shape(0))};
    for (std::size_t d = 0; d < out.lower.size(); ++d) {
        require(out.lower[d] <= out.upper[d] && within(out.upper[d] - out.lower[d], std::numeric_limits<T>::max()),
                "bounds that are no range");
    }
    return out;
}

// Particles as rows.
template <class T> nb::object position_rows(const swarm<T>& s) {
    const std::size_t n = s.active(), dims = s.dims();
    std::vector<T> out(n * dims);
    for (std::size_t d = 0; d < dims; ++d) {
        const T* from = s.positions() + d * s.stride();
        for (std::size_t i = 0; i < n; ++i) out[i * dims + d] = from[i];
    }
    return array_of(std::move(out), {n, dims});
}

template <class T> std::vector<std::vector<T>> rows_of(const in2<T>& rows, int dims) {
    require(rows.shape(1) == static_cast<std::size_t>(dims), "wrong number of dimensions");
    std::vector<std::vector<T>> out(rows.shape(0));
    for (std::size_t i = 0; i < out.size(); ++i) {
        for (std::size_t d = 0; d < rows.shape(1); ++d) out[i].push_back(rows(i, d));
    }
    return out;
}

template <class T> nb::dict get_state(swarm<T>& s) {
    nb::dict out;
    s.visit_state([&](const char* name, std::vector<T>& values) {
        out[name] = array_of(std::vector<T>(values), {values.size()});
    });
    out["counters"] = array_of(s.counters(), {s.counters().size()});
    return out;
}

template <class T> void set_state(swarm<T>& s, nb::dict state) {
    constexpr const char* other = "a checkpoint of another swarm";
    in1<std::int64_t> counters;
    const nb::object counters_given = state["counters"];  // a missing key raises here
    require(nb::try_cast(counters_given, counters), other);
    const std::vector<std::int64_t> counted(counters.data(), counters.data() + counters.shape(0));
    require(s.fits(counted), other);
    // All is checked before anything is changed.
    std::vector<std::vector<T>> saved;
    s.visit_state([&](const char* name, std::vector<T>& values) {
        in1<T> array;
        const nb::object given = state[name];
        require(nb::try_cast(given, array), other);
        const std::string key = name;
        const std::size_t size = array.shape(0), dims = static_cast<std::size_t>(s.dims());
        if (key == "archive") require(size % dims == 0, other);
        else if (key == "gain" || key == "drawn_factor" || key == "drawn_crossover")
            require(s.fits_candidates(counted, size), other);
        else require(size == values.size(), other);
        saved.emplace_back(array.data(), array.data() + size);
    });
    std::size_t next = 0;
    s.visit_state([&](const char*, std::vector<T>& values) { values = saved[next++]; });
    s.restore_counters(counted);
}

template <class T, class Objective>
nb::list search(const Objective& objective, in1<double> lower, in1<double> upper, const swarm_settings& settings,
                std::uint64_t seed, std::uint32_t first_trial, int trials, int threads, bool keep_positions,
                bool stop_when_feasible, double seconds, std::optional<in2<T>> initial, nb::object progress) {
    require(static_cast<int>(lower.shape(0)) == objective.dims(), "wrong number of dimensions");
    require(trials >= 0 && trials <= 100'000'000 && seconds >= 0, "a number of trials or seconds out of range");
    const search_limits limits{stop_when_feasible, seconds};
    bool interrupted = false;
    const progress_callback tell_caller = [&](std::uint64_t done) {
        nb::gil_scoped_acquire hold;
        if (interrupted) return false;
        if (PyErr_CheckSignals() != 0) {
            interrupted = true;
            return false;
        }
        if (progress.is_none()) return true;
        nb::object answer = progress(done);
        if (answer.is_none()) return true;
        if (!PyBool_Check(answer.ptr())) throw nb::type_error("progress answers with None, True or False");
        return answer.is(nb::bool_(true));
    };
    const box<T> bounds = box_of<T>(lower, upper);
    auto start_swarm = [&](int trial) {
        return swarm<T>(settings, bounds.lower, bounds.upper, seed, first_trial + static_cast<std::uint32_t>(trial));
    };
    std::vector<std::vector<T>> first_rows;
    if (initial) first_rows = rows_of<T>(*initial, objective.dims());
    std::vector<trial_result<T>> results;
    {
        nb::gil_scoped_release free;
        results =
            run_trials<T>(objective, start_swarm, trials, limits, keep_positions, threads, tell_caller, first_rows);
    }
    if (interrupted) throw nb::python_error();
    nb::list out;
    for (trial_result<T>& r : results) {
        nb::dict d;
        const std::size_t n = r.rounds;
        d["fitness"] = r.best.fitness;
        d["violation"] = r.best.violation;
        d["rounds"] = r.rounds;
        d["evaluations"] = r.evaluations;
        d["first_feasible_round"] = r.first_feasible_round;
        d["position"] = array_of(std::move(r.position), {r.rounds ? static_cast<std::size_t>(objective.dims()) : 0});
        d["fitness_history"] = array_of(std::move(r.fitness), {n});
        d["violation_history"] = array_of(std::move(r.violation), {n});
        d["evaluation_history"] = array_of(std::move(r.spent), {n});
        if (keep_positions)
            d["position_history"] = array_of(std::move(r.positions), {n, static_cast<std::size_t>(objective.dims())});
        out.append(d);
    }
    return out;
}

template <class T, class Objective> void bind_search(nb::class_<Objective>& c) {
    c.def("evaluate", &evaluate<T, Objective>)
        .def("search", &search<T, Objective>, "lower"_a, "upper"_a, "settings"_a, "seed"_a, "first_trial"_a, "trials"_a,
             "threads"_a, "keep_positions"_a, "stop_when_feasible"_a, "seconds"_a, "initial"_a.none(),
             "progress"_a.none());
}

template <class T> void bind_scalar(nb::module_& m, const std::string& suffix) {
    using SM = paper_objective<T>;
    using RM = reach_objective<T>;
    const auto named = [&](const char* name) { return std::string(name) + suffix; };

    nb::class_<model<T>>(m, named("Model").c_str())
        .def_static("make", &make_model<T>, "parent"_a, "kind"_a, "dof"_a, "multiplier"_a, "offset"_a, "rotation"_a,
                    "translation"_a, "dofs"_a, "point_joint"_a, "point_local"_a, "capsule_a"_a, "capsule_b"_a,
                    "capsule_radius"_a, "sphere_center"_a, "sphere_radius"_a)
        .def("joint_frames", &joint_frames<T>)
        .def("points", &point_positions<T>)
        .def("clearances", &clearances<T>)
        .def("surrounded", &surrounded<T>, "index"_a, "joint"_a, "link"_a, "a"_a, "b"_a, "radius"_a, "pairs"_a,
             "obstacle_kind"_a, "obstacle_numbers"_a)
        .def("obstacle_clearances", &obstacle_clearances<T>)
        .def("pair_clearances", &pair_clearances<T>)
        .def("shortfalls", &shortfalls<T>)
        .def("eased", &eased<T>, "capsule"_a, "obstacle"_a, "other"_a, "most"_a)
        .def("weighed", &weighed<T>, "mass"_a, "com"_a, "inertia"_a)
        .def("momentum_terms", &momentum_terms<T>);

    nb::class_<SM> seed(m, named("SeedObjective").c_str());
    seed.def("__init__",
             [](SM* self, const model<T>& scene, in1<std::int32_t> centers, int tip, in1<double> goal,
                in1<double> weights, bool must_reach, double tolerance) {
                 require(tip >= 0 && tip < static_cast<int>(scene.points.size()) && goal.shape(0) == 3
                             && weights.shape(0) == 3,
                         "the objective's arrays do not fit");
                 for (std::size_t i = 0; i < centers.shape(0); ++i) {
                     require(centers(i) >= 0 && centers(i) < static_cast<int>(scene.points.size()),
                             "a centre is no point");
                 }
                 SM made{}, *o = &made;  // moved in place when nothing can go wrong any more
                 o->scene = scene;
                 o->tip = tip;
                 double rest = 0;
                 for (std::size_t i = 0; i < centers.shape(0); ++i) {
                     const point<T>& p = scene.points.at(centers(i));
                     if (p.joint >= 0) {
                         o->centers.push_back(centers(i));
                         continue;
                     }
                     for (const sphere<T>& ball : scene.spheres) {
                         double squared = 0;
                         for (int k = 0; k < 3; ++k)
                             squared += (double(ball.center[k]) - p.local[k]) * (double(ball.center[k]) - p.local[k]);
                         rest += std::sqrt(squared);
                     }
                 }
                 o->f1_at_rest = static_cast<T>(rest);
                 for (int k = 0; k < 3; ++k) {
                     o->goal[k] = static_cast<T>(goal(k));
                     o->weight[k] = static_cast<T>(weights(k));
                 }
                 o->must_reach = must_reach;
                 o->tolerance = static_cast<T>(tolerance);
                 new (self) SM(std::move(made));
             })
        .def("terms", &paper_terms<T>);
    bind_search<T>(seed);

    nb::class_<RM> reach(m, named("ReachObjective").c_str());
    reach.def("__init__", [](RM* self, const model<T>& scene, in1<std::int32_t> points, in2c<double> targets,
                             in1<double> tolerances, double margin, in1<double> home) {
        const std::size_t count = points.shape(0);
        require(count >= 1 && targets.shape(0) == count && targets.shape(1) == 3 && tolerances.shape(0) == count,
                "the objective's arrays do not fit");
        require(home.shape(0) == static_cast<std::size_t>(scene.robot.dofs), "home has another length");
        RM made{}, *o = &made;
        o->scene = scene;
        for (std::size_t i = 0; i < count; ++i) {
            require(points(i) >= 0 && points(i) < static_cast<int>(scene.points.size()), "a target's point is none");
            typename RM::target to{points(i), {}, static_cast<T>(tolerances(i))};
            take3(targets.data() + 3 * i, to.position);
            o->targets.push_back(to);
        }
        o->margin = static_cast<T>(margin);
        o->home.assign(home.data(), home.data() + home.shape(0));
        new (self) RM(std::move(made));
    });
    bind_search<T>(reach);

    bind_motion_search<T>(m, suffix);

    nb::class_<swarm<T>>(m, named("Swarm").c_str())
        .def("__init__",
             [](swarm<T>* self, const swarm_settings& settings, in1<double> lower, in1<double> upper,
                std::uint64_t seed, std::uint32_t trial) {
                 box<T> bounds = box_of<T>(lower, upper);
                 new (self) swarm<T>(settings, std::move(bounds.lower), std::move(bounds.upper), seed, trial);
             })
        .def("ask", [](swarm<T>& s) { s.ask(); })
        .def("positions", &position_rows<T>)
        .def("place_first", [](swarm<T>& s, in2<T> rows) { s.place_first(rows_of<T>(rows, s.dims())); })
        .def("tell",
             [](swarm<T>& s, in1<T> f, in1<T> c) {
                 require(s.asked(), "told without having asked");
                 require(f.shape(0) == static_cast<std::size_t>(s.active()) && c.shape(0) == f.shape(0),
                         "wrong number of values");
                 s.tell(f.data(), c.data());
             })
        .def_prop_ro("round", &swarm<T>::round)
        .def_prop_ro("active", &swarm<T>::active)
        .def_prop_ro("spent", &swarm<T>::spent)
        .def_prop_ro("evaluations", &swarm<T>::evaluations)
        .def_prop_ro("best_fitness", [](const swarm<T>& s) { return s.best().fitness; })
        .def_prop_ro("best_violation", [](const swarm<T>& s) { return s.best().violation; })
        .def_prop_ro(
            "best_position",
            [](const swarm<T>& s) { return array_of(std::vector<T>(s.best_position()), {s.best_position().size()}); })
        .def_prop_ro("failed_evaluations", &swarm<T>::failed_evaluations)
        .def("state", &get_state<T>)
        .def("restore", &set_state<T>);

    m.def(named("uniforms").c_str(), [](std::uint64_t seed, std::uint32_t trial, std::uint32_t purpose,
                                        std::uint32_t iteration, std::uint32_t first, std::uint32_t block) {
        const uniform_block<T> block_of =
            uniforms<T>(random_key(seed, trial, static_cast<stream>(purpose)), iteration, first, block);
        std::vector<T> out(4 * word_lanes);
        for (int i = 0; i < 4; ++i) {
            for (int g = 0; g < packs_of_words<T>; ++g) block_of.u[i][g].store(&out[i * word_lanes + g * lanes_of<T>]);
        }
        return array_of(std::move(out), {4, static_cast<std::size_t>(word_lanes)});
    });
    m.def(named("sincos").c_str(), [](in1<T> x) {
        std::vector<T> s(x.shape(0)), c(x.shape(0));
        for (std::size_t i = 0; i < s.size(); ++i) {
            pack<T> sine, cosine;
            sincos(pack<T>(x(i)), sine, cosine);
            store_lanes(sine, &s[i], 1);
            store_lanes(cosine, &c[i], 1);
        }
        const std::size_t n = s.size();
        return nb::make_tuple(array_of(std::move(s), {n}), array_of(std::move(c), {n}));
    });
}

template <class E> E chosen(const std::string& name, std::initializer_list<std::pair<const char*, E>> known) {
    for (const auto& [key, value] : known) {
        if (name == key) return value;
    }
    throw nb::value_error("an unknown choice");
}

swarm_settings settings_from(const nb::dict& given) {
    nb::dict d;
    d.update(given);
    swarm_settings s;
    std::string variant = "pso", bounds = "absorb", constraints = "feasible_first";
    field(d, "variant", variant);
    field(d, "bounds", bounds);
    field(d, "constraints", constraints);
    s.variant = chosen<swarm_variant>(variant, {{"pso", swarm_variant::pso},
                                                {"symbiotic", swarm_variant::symbiotic},
                                                {"cooperative", swarm_variant::cooperative},
                                                {"evolving", swarm_variant::evolving}});
    s.bounds = chosen<bounds_rule>(
        bounds,
        {{"absorb", bounds_rule::absorb}, {"reflect", bounds_rule::reflect}, {"periodic", bounds_rule::periodic}});
    s.constraints = chosen<constraint_rule>(
        constraints, {{"feasible_first", constraint_rule::feasible_first}, {"penalty", constraint_rule::penalty}});
    field(d, "particles", s.particles);
    field(d, "evaluations", s.evaluations);
    field(d, "inertia_start", s.inertia_start);
    field(d, "inertia_end", s.inertia_end);
    field(d, "cognitive", s.cognitive);
    field(d, "social", s.social);
    field(d, "cooperation", s.cooperation);
    field(d, "velocity_clamp", s.velocity_clamp);
    field(d, "start_velocity", s.start_velocity);
    field(d, "ring", s.ring);
    field(d, "penalty_start", s.penalty_start);
    field(d, "penalty_end", s.penalty_end);
    field(d, "penalty_rise", s.penalty_rise);
    field(d, "tolerance_share", s.tolerance_share);
    field(d, "tolerance_until", s.tolerance_until);
    field(d, "tolerance_power", s.tolerance_power);
    field(d, "evolving_share", s.evolving_share);
    field(d, "elite_share", s.elite_share);
    field(d, "memory", s.memory);
    field(d, "shrink_to", s.shrink_to);
    require(d.size() == 0, "an unknown setting");
    require(s.particles >= 1 && s.particles <= most_particles && s.memory >= 1 && s.memory <= most_entries,
            "settings out of range");
    require(s.evaluations >= 1 && s.evaluations <= most_evaluations, "a budget out of range");
    for (double x : {s.inertia_start, s.inertia_end, s.cognitive, s.social, s.cooperation, s.velocity_clamp,
                     s.start_velocity, s.penalty_start, s.penalty_end, s.penalty_rise}) {
        require(within(x, most_weight), "a number that is none, or too large");
    }
    require(s.tolerance_power >= 0 && s.tolerance_power <= most_power && s.ring <= most_particles
                && s.shrink_to <= most_particles,
            "settings out of range");
    require(s.evolving_share > 0 && s.evolving_share <= 1 && s.elite_share > 0 && s.elite_share <= 1,
            "shares out of range");
    require(s.tolerance_share >= 0 && s.tolerance_share <= 1 && s.tolerance_until > 0 && s.ring >= 0
                && s.shrink_to >= 0,
            "settings out of range");
    return s;
}

NB_MODULE(SPACEARM_MODULE, m) {
    m.doc() = "The native kernel, one build an instruction level";
    nb::class_<swarm_settings>(m, "SwarmSettings").def_static("make", &settings_from);
    bind_scalar<double>(m, "64");
    bind_scalar<float>(m, "32");
    bind_exact(m);
    m.def("spline_values", &spline_values);
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
