// What a spline motion is worth: the terms of its fitness, its clearance at many instants, and the other constraints.
//
// The lanes are instants of one motion. So a motion is given up as soon as it is known to be no use: one that is longer
// than what is to be beaten costs no kinematics, one that collides mostly a single pack.
#pragma once

#include "motion/base_models.hpp"

namespace SPACEARM_NAMESPACE {

template <class T> class motion_checker {
  public:
    explicit motion_checker(const motion_problem<T>& problem)
        : p_(problem), base_(base_model_of(problem)), memory_(problem.scene.envelope), work_(problem.scene),
          q_(problem.dofs()), near_(problem.near_pairs) {}

    std::int64_t looks = 0;  // at the end of a motion, for its terminal constraints
    // Configurations looked at so far.
    std::int64_t configurations() const { return edge_configurations_ + base_->configurations; }
    const motion_problem<T>& problem() const { return p_; }
    base_model<T>& base() { return *base_; }

    // A proof failed at s: that instant and others within `spread` are looked at from now on.
    void add_instant(double s, double spread) {
        std::vector<double> around(W);
        for (int i = 0; i < W; ++i) around[i] = std::min(1.0, std::max(0.0, s + spread * (2.0 * i / W - 1.0)));
        base_->add_instants(around);
    }

    // The weighted sum of the terms; those without a weight are 0 unless `all`.
    T fitness(const motion<T>& m, bool all = false, T* terms = nullptr) {
        const motion_weights<T>& w = p_.weight;
        T value[term_count] = {};
        if (m.interior > most_tabled) local_.take(m, p_.start.data(), p_.end(m), p_.dofs());
        if (all || w.length > 0) value[term_length] = length(m);
        if (all || w.duration > 0) {
            base_->follow(m, sampling::coarse, false);
            value[term_duration] = base_->duration(fastest(m));
        }
        if (all || w.smoothness > 0) value[term_smoothness] = smoothness(m);
        if (all || w.carried()) carried(m, value);
        if (all || w.of_base()) of_base(m, value);
        if (terms) std::copy(value, value + term_count, terms);
        T sum = 0;
        for (int i = 0; i < term_count; ++i) {
            const T weight = w.*motion_terms<T>[i].weight;
            sum += weight > 0 ? weight * value[i] : T(0);
        }
        return sum;
    }

    // Sum over the coarse instants of the clearance's shortfall [m], that of near pairs in the order of the motion, and
    // of the other constraints' violations; given up beyond `limit`. With limit 0 it says only whether there is any.
    // Infinite for numbers that are none.
    T violation(const motion<T>& m, T limit) {
        if (!sane(m)) return infinity;
        base_->follow(m, sampling::coarse, true);
        T sum = unmet(m);
        if (!(sum <= infinity)) return infinity;
        const int packs = base_->packs();
        near_.begin();
        for (int i = 0; i < packs && !(sum > limit); ++i) {
            const pack<T> s = shortfall_at(i, limit <= T(0));
            if (any(pack<T>(T(0)) < s)) sum += sum_of(s);
            if (near_.any()) watch_near_pairs(i);
        }
        if (near_.any() && !(sum > limit)) sum += near_.shortfall(m.goal);
        return sum;
    }
    // Whether the finer instants, and those of failed proofs, are free as well.
    bool finely_free(const motion<T>& m, sampling density = sampling::fine) {
        if (!sane(m)) return false;
        base_->follow(m, density, true);
        if (!(unmet(m) <= T(0))) return false;
        const int packs = base_->packs();
        near_.begin();
        for (int i = 0; i < packs; ++i) {
            if (any(pack<T>(T(0)) < shortfall_at(i, true))) return false;
            if (near_.any()) watch_near_pairs(i);
        }
        return !near_.any() || near_pairs_keep(m);
    }
    bool free(const motion<T>& m) { return violation(m, T(0)) <= T(0) && finely_free(m); }
    // Whether a motion that is finely free is so between its instants, too: asked of those that are to be the best, for
    // the shorter a motion is made, the nearer it passes obstacles there.
    bool densely_free(const motion<T>& m) { return !base_->hints().dense || finely_free(m, sampling::dense); }
    // The same; if it is not free for its clearance, `at` gets the instants, from 0 to 1, of the first pack that is
    // not.
    bool free(const motion<T>& m, std::vector<double>& at) {
        at.clear();
        if (!sane(m)) return false;
        for (sampling density : {sampling::coarse, sampling::fine}) {
            base_->follow(m, density, true);
            if (!(unmet(m) <= T(0))) return false;
            near_.begin();
            for (int i = 0; i < base_->packs(); ++i) {
                T lane[W];
                shortfall_at(i, true).store(lane);
                for (int k = 0; k < W; ++k) {
                    if (lane[k] > T(0)) at.push_back(base_->instant_at(i, k));
                }
                if (!at.empty()) return false;
                if (near_.any()) watch_near_pairs(i);
            }
            if (near_.any() && !(density == sampling::coarse ? near_.shortfall(m.goal) <= T(0) : near_pairs_keep(m)))
                return false;
        }
        return true;
    }

    // Whether the straight edge between two configurations is free, the base where it is at the beginning: at a pack of
    // instants or more, the second end included.
    bool edge_free(const T* from, const T* to) {
        T lane[W];
        for (int l = 0; l < base_->edge_packs(); ++l) {
            for (int i = 0; i < W; ++i) lane[i] = static_cast<T>(i + 1 - gap_filler(l)) / T(W);
            const pack<T> share = pack<T>::load(lane);
            for (int d = 0; d < p_.dofs(); ++d) q_[d] = share * (to[d] - from[d]) + from[d];
            edge_configurations_ += W;
            base_->place_joints(q_.data(), work_.frames.data());
            memory_.base = nullptr;
            if (any(pack<T>(T(0)) < shortfall_in_place({p_.margin}, true))) return false;
        }
        return true;
    }

    // Which of a pack of configurations are free, the base where it is at the beginning.
    free_lanes<T> free_configurations(const pack<T>* q) {
        edge_configurations_ += W;
        base_->place_joints(q, work_.frames.data());
        memory_.base = nullptr;
        free_lanes<T> out;
        compare_all<T>(p_.scene.envelope, work_.frames.data(), p_.scene.obstacles, {p_.margin}, memory_, out);
        return out;
    }

    const spline_table<T>& table(int interior) {
        if (interior >= static_cast<int>(tables_.size())) tables_.resize(interior + 1);
        if (!tables_[interior]) tables_[interior] = spline_table_of<T>(interior);
        return *tables_[interior];
    }

    // Projects a motion onto its terminal constraints; false if it cannot be. Only the end's own row, if it is free,
    // and the rows between move. go_on() is asked before every round.
    template <class GoOn> bool project_onto_ends(motion<T>& m, terminal_solver<T>& solver, GoOn&& go_on) {
        const terminal_constraints& ends = p_.base.ends;
        if (!ends.any()) return true;
        if (p_.base.free_end && m.end.empty()) m.end.assign(p_.goal(m.goal), p_.goal(m.goal) + p_.dofs());
        std::vector<T> x = m.points, lower, upper;
        if (p_.base.free_end) x.insert(x.end(), m.end.begin(), m.end.end());
        for (std::size_t i = 0; i < x.size(); i += p_.dofs()) {
            lower.insert(lower.end(), p_.lower.begin(), p_.lower.end());
            upper.insert(upper.end(), p_.upper.begin(), p_.upper.end());
        }
        motion<T> tried = m;
        const auto write = [&](const std::vector<T>& from, motion<T>& to) {
            std::copy(from.begin(), from.begin() + to.points.size(), to.points.begin());
            if (p_.base.free_end) std::copy(from.begin() + to.points.size(), from.end(), to.end.begin());
        };
        const auto look = [&](const std::vector<T>& at, bool roughly) {
            write(at, tried);
            ++looks;
            return base_->at_end(tried, ends, roughly);
        };
        // A share of the tolerances that float rounds to, and double does not reach.
        const bool met = solver.solve(x, lower, upper, ends.count(), sizeof(T) == 4 ? 0.2 : 1e-4, look, go_on);
        write(x, m);
        return met;
    }
    terminal_solver<T>& solver() { return solver_; }

  private:
    static constexpr int W = lanes_of<T>;
    static constexpr T infinity = std::numeric_limits<T>::infinity();
    // Of a duration asked for: the bound over the hulls, which the proof uses, is a little longer than what instants
    // say.
    static constexpr T in_time = T(0.98);

    // By how much the clearance falls short of what is asked for, with the frames in place.
    SPACEARM_NOINLINE pack<T> shortfall_in_place(const asked_clearance<T>& asked, bool stop_early) {
        return shortfall(p_.scene.envelope, work_.frames.data(), p_.scene.obstacles, asked, memory_, stop_early);
    }
    // Keeps the near pairs' clearances at pack i, with the envelope in place.
    SPACEARM_NOINLINE void watch_near_pairs(int i) {
        near_.add(p_.scene, work_.frames.data(), memory_, [&](int lane) { return base_->instant_at(i, lane); });
    }
    // Whether near pairs keep what is asked of them, after all packs of the fine sampling; together with the coarse
    // ones.
    bool near_pairs_keep(const motion<T>& m) {
        if (!base_->repeats_coarse()) {
            base_->follow(m, sampling::coarse, true);
            for (int i = 0; i < base_->packs(); ++i) {
                memory_.base = base_->place(i, work_.frames.data());
                place(p_.scene.envelope, work_.frames.data(), memory_);
                watch_near_pairs(i);
            }
        }
        return near_.shortfall(m.goal) <= T(0);
    }
    // The same at pack i of the motion followed.
    pack<T> shortfall_at(int i, bool stop_early) {
        memory_.base = base_->place(i, work_.frames.data());
        return shortfall_in_place({p_.margin}, stop_early);
    }
    // The fastest uniform time within all limits, those of the base too, of the motion followed.
    T fastest(const motion<T>& m) {
        const base_demands<T>& b = p_.base;
        T out = duration(m);
        if (b.most_rate > T(0)) out = std::max(out, base_->rate() / b.most_rate);
        if (b.most_arm > T(0)) out = std::max(out, base_->arm_momentum() / b.most_arm);
        return out;
    }
    // How far limits are passed, each as a share of itself, and the terminal constraints missed, of the motion
    // followed.
    T unmet(const motion<T>& m) {
        const base_demands<T>& b = p_.base;
        T sum = 0;
        if (b.ends.any()) sum = static_cast<T>(base_->missed(b.ends).beyond);
        if (b.most_turned > T(0)) sum += beyond(static_cast<T>(base_->peak_turn()), b.most_turned);
        if (b.momentum.duration > T(0)) sum += beyond(fastest(m), in_time * b.momentum.duration);
        return sum;
    }
    // By what share of itself a limit is passed; a NaN stays one.
    static T beyond(T value, T limit) { return value <= limit ? T(0) : value / limit - T(1); }
    // Neither endless nor none: far beyond any joint, and where float32 has no digit left. A NaN is not sane.
    bool sane(const motion<T>& m) const {
        bool out = true;
        for (const auto& numbers : {&m.points, &m.end}) {
            for (T x : *numbers) out &= std::abs(x) <= T(furthest);
        }
        return out;
    }

    // ---- terms of the fitness
    // -----------------------------------------------------------------------------------------
    // Of a motion of few control points the lanes are its coarse instants, else the joints at one instant.
    T length(const motion<T>& m) {
        if (m.interior > most_tabled) {
            T sum = 0;
            for (int i = 0; i < local_.looks(); ++i) sum += std::sqrt(squared_rate(1, i));
            return sum / T(local_.looks());
        }
        const spline_table<T>& t = table(m.interior);
        pack<T> sum(T(0));
        for (int l = 0; l < sample_packs_coarse; ++l) {
            pack<T> squared(T(0));
            add_squared_rates(m, t, 1, l, squared);
            sum += sqrt(squared);
        }
        return sum_of(sum) / T(sample_packs_coarse * lanes_of<T>);
    }
    T smoothness(const motion<T>& m) {
        T sum = 0;
        if (m.interior > most_tabled) {
            for (int i = 0; i < local_.looks(); ++i) sum += squared_rate(3, i);
            return sum / T(local_.looks());
        }
        const spline_table<T>& t = table(m.interior);
        pack<T> squared(T(0));
        for (int l = 0; l < sample_packs_coarse; ++l) add_squared_rates(m, t, 3, l, squared);
        return sum_of(squared) / T(sample_packs_coarse * lanes_of<T>);
    }
    void add_squared_rates(const motion<T>& m, const spline_table<T>& t, int derivative, int l,
                           pack<T>& squared) const {
        for (int d = 0; d < p_.dofs(); ++d) {
            const pack<T> v = p_.coordinate(m, &t.value[derivative][pack_offset<T>(l, m.interior)], d);
            squared += v * v;
        }
    }
    T squared_rate(int derivative, int look) const {
        pack<T> squared(T(0));
        local_.derivative(derivative, look, [&](int, const pack<T>& v) { squared += v * v; });
        return sum_of(squared);
    }
    T duration(const motion<T>& m) {
        T out = 0;
        const bool many = m.interior > most_tabled;
        if (many) local_.take(m, p_.start.data(), p_.end(m), p_.dofs());
        const std::vector<T>* limits[4] = {nullptr, &p_.velocity, &p_.acceleration, &p_.jerk};
        for (int k = 1; k < 4; ++k) {
            if (limits[k]->empty()) continue;
            const T share = many ? greatest_share(k, *limits[k]) : greatest_share(m, k, *limits[k]);
            out = std::max(out, k == 1 ? share : k == 2 ? std::sqrt(share) : static_cast<T>(cube_root(share)));
        }
        return out;
    }
    // The greatest share of its joint's limit that a derivative takes.
    T greatest_share(const motion<T>& m, int derivative, const std::vector<T>& limit) {
        const spline_table<T>& t = table(m.interior);
        pack<T> most(T(0));
        for (int l = 0; l < sample_packs_coarse; ++l) {
            for (int d = 0; d < p_.dofs(); ++d) {
                const pack<T> v = p_.coordinate(m, &t.value[derivative][pack_offset<T>(l, m.interior)], d);
                most = max(most, abs(v) * (T(1) / limit[d]));
            }
        }
        return greatest_of(most);
    }
    T greatest_share(int derivative, const std::vector<T>& limit) const {
        std::vector<T> inverse((limit.size() + W - 1) / W * W, T(0));
        for (std::size_t d = 0; d < limit.size(); ++d) inverse[d] = T(1) / limit[d];
        pack<T> most(T(0));
        for (int i = 0; i < local_.looks(); ++i) {
            local_.derivative(derivative, i, [&](int first, const pack<T>& v) {
                most = max(most, abs(v) * pack<T>::load(&inverse[first]));
            });
        }
        return greatest_of(most);
    }

    void of_base(const motion<T>& m, T* value) {
        base_->follow(m, sampling::coarse, false);
        value[term_base_final] = static_cast<T>(base_->final_turn());
        value[term_base_peak] = static_cast<T>(base_->peak_turn());
        const T inverse = T(1) / std::max(base_->duration(fastest(m)), std::numeric_limits<T>::min());
        value[term_base_rate] = base_->rate() * inverse;
        value[term_joint_momentum] = base_->arm_momentum() * inverse;
    }

    // What depends on where the arm is: what lacks to the preferred clearance, the paper's terms, and the path of the
    // end effector.
    void carried(const motion<T>& m, T* value) {
        base_->follow(m, sampling::coarse, true);
        const int packs = base_->packs(), samples = packs * W;
        const asked_clearance<T> preferred{p_.preferred_clearance, true, p_.margin};
        std::vector<T> tip[3];
        for (auto& row : tip) row.resize(samples);
        pack<T> lacks(T(0)), f[3] = {pack<T>(T(0)), pack<T>(T(0)), pack<T>(T(0))};
        const place3 last = tip_at_end();
        const vec3<T> end{pack<T>(last.x[0]), pack<T>(last.x[1]), pack<T>(last.x[2])};
        for (int i = 0; i < packs; ++i) {
            memory_.base = base_->place(i, work_.frames.data());
            place_points(p_.scene, memory_.base, work_);
            if (p_.preferred_clearance > T(0)) lacks += shortfall_in_place(preferred, false);
            const vec3<T>& at = work_.points[p_.tip];
            at.x.store(&tip[0][i * W]);
            at.y.store(&tip[1][i * W]);
            at.z.store(&tip[2][i * W]);
            add_paper_terms(end, f);
        }
        value[term_clearance] = sum_of(lacks) / T(samples);
        for (int i = 0; i < 3; ++i) value[term_f1 + i] = sum_of(f[i]) / T(samples);
        T sum = 0;
        place3 before{};
        bool first = true;
        for (const instant& at : base_->path()) {
            place3 now = last;
            if (at.pack == instant::start) now = tip_at_start();
            for (int k = 0; k < 3 && at.pack >= 0; ++k) now.x[k] = tip[k][at.pack * W + at.lane];
            T squared = 0;
            for (int k = 0; k < 3; ++k) squared += (now.x[k] - before.x[k]) * (now.x[k] - before.x[k]);
            if (!first) sum += std::sqrt(squared);
            first = false;
            before = now;
        }
        value[term_tip] = sum;
    }
    struct place3 {
        T x[3];
    };
    place3 last_tip() const {
        const vec3<T>& at = work_.points[p_.tip];
        const pack<T>* c[3] = {&at.x, &at.y, &at.z};
        place3 out;
        T lane[W];
        for (int k = 0; k < 3; ++k) {
            c[k]->store(lane);
            out.x[k] = lane[W - 1];
        }
        return out;
    }
    place3 tip_at_end() {
        place_points(p_.scene, base_->place_end(work_.frames.data()), work_);
        return last_tip();
    }
    place3 tip_at_start() {
        for (int d = 0; d < p_.dofs(); ++d) q_[d] = pack<T>(p_.start[d]);
        base_->place_joints(q_.data(), work_.frames.data());
        place_points<T>(p_.scene, nullptr, work_);
        return last_tip();
    }
    // The paper's terms at a pack of instants, with the points in place.
    void add_paper_terms(const vec3<T>& end, pack<T>* f) const {
        const vec3<T> left = end - work_.points[p_.tip];
        const pack<T> d2 = dot(left, left);
        f[1] += sqrt(d2 + T(1));  // eq. (6)
        f[2] += sqrt(d2);         // eq. (7)
        for (int i : p_.centers) {
            for (const auto& o : p_.scene.obstacle_centers) {
                const vec3<T> r = work_.points[i] - constant(o.data());
                f[0] += sqrt(dot(r, r));  // eq. (5)
            }
        }
    }

    const motion_problem<T>& p_;
    std::unique_ptr<base_model<T>> base_;
    envelope_memory<T> memory_;
    workspace<T> work_;
    std::vector<pack<T>> q_;
    near_pair_watch<T> near_;
    local_spline<T> local_;  // of the motion looked at last, if it has many control points
    std::int64_t edge_configurations_ = 0;
    std::vector<std::shared_ptr<const spline_table<T>>> tables_;
    terminal_solver<T> solver_;
};

}  // namespace SPACEARM_NAMESPACE
