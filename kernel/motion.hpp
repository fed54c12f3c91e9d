// A spline motion, looked at: lengths and other terms of its fitness, and its clearance at many instants.
//
// The lanes are instants of one motion. So each motion stops the moment its fate is known: one that is longer than what
// is to be beaten costs no kinematics, one that collides mostly a single pack.
#pragma once

#include "motion_problem.hpp"

namespace SPACEARM_NAMESPACE {

template <class T> SPACEARM_INLINE T sum_of(const pack<T>& x) {
    T lane[lanes_of<T>], sum = 0;
    x.store(lane);
    for (int i = 0; i < lanes_of<T>; ++i) sum += lane[i];
    return sum;
}
template <class T> SPACEARM_INLINE T greatest_of(const pack<T>& x) {
    T lane[lanes_of<T>];
    x.store(lane);
    return *std::max_element(lane, lane + lanes_of<T>);
}

// The names and order of the terms, as `terms` fills them.
enum term {
    term_length,
    term_duration,
    term_tip,
    term_clearance,
    term_smoothness,
    term_f1,
    term_f2,
    term_f3,
    term_base_final,
    term_base_peak,
    term_base_rate,
    term_joint_momentum,
    term_count
};

template <class T> class motion_checker {
  public:
    explicit motion_checker(const motion_problem<T>& problem)
        : p_(problem), body_(problem.scene.envelope), work_(problem.scene), q_(problem.dofs()), track_(problem.scene) {}

    std::int64_t configurations = 0;  // looked at so far
    std::int64_t looks = 0;           // at the end of a floating base's motion

    // An instant that a proof stumbled over, and others around it, looked at from now on as well; the middle lane is
    // it. What slipped through once does so again elsewhere, so all instants, and those of the trees' edges, are made
    // twice as dense.
    void add_instant(double s, double spread) {
        constexpr int W = lanes_of<T>;
        std::vector<double> instants(W);
        for (int i = 0; i < W; ++i) instants[i] = std::min(1.0, std::max(0.0, s + spread * (2.0 * i / W - 1.0)));
        extra_.push_back(instants);
        if (p_.base.on) {
            fine_nodes_ = std::min(2 * fine_nodes_, most_instants);
            edge_packs_ = std::min(2 * edge_packs_, most_instants / W);
            return;
        }
        if (packs_ * W >= most_instants) return;
        for (int l = packs_; l < 2 * packs_; ++l) {
            for (int i = 0; i < W; ++i) instants[i] = sample_instant(l, i, W);
            extra_.push_back(instants);
        }
        packs_ *= 2;
        edge_packs_ *= 2;
    }

    // Terms that need no kinematics, and the others with `carried`; those without a weight are 0 unless `all`.
    T fitness(const motion<T>& m, bool all = false, T* terms = nullptr) {
        const motion_weights<T>& w = p_.weight;
        const spline_table<T>& t = table(m.interior);
        T value[term_count] = {};
        if (all || w.length > 0) value[term_length] = length(m, t);
        if (all || w.duration > 0)
            value[term_duration] = p_.base.on ? time_of(m, follow(m, coarse_nodes, false)) : duration(m, t);
        if (all || w.smoothness > 0) value[term_smoothness] = smoothness(m, t);
        if (all || w.carried()) p_.base.on ? carried_in_space(m, value) : carried(m, t, value);
        if (p_.base.on && (all || w.of_base())) of_base(m, value);
        if (terms) std::copy(value, value + term_count, terms);
        const T weights[term_count] = {w.length,  w.duration, w.tip,     w.clearance, w.smoothness, w.seed[0],
                                       w.seed[1], w.seed[2],  w.base[0], w.base[1],   w.base[2],    w.base[3]};
        T sum = 0;
        for (int i = 0; i < term_count; ++i) sum += weights[i] > 0 ? weights[i] * value[i] : T(0);
        return sum;
    }

    // Sum over the coarse instants of the clearance's shortfall [m], and what is missing at the end of a floating
    // base's motion; given up beyond `limit`. With limit 0 it says only whether there is any. Infinite for numbers that
    // are none.
    T violation(const motion<T>& m, T limit) {
        if (!sane(m)) return infinity;
        if (p_.base.on) return violation_in_space(m, limit);
        const spline_table<T>& t = table(m.interior);
        const T time = p_.base.momentum.duration;
        T sum = time > T(0) ? beyond(duration(m, t), in_time * time) : T(0);
        for (int l = 0; l < sample_packs_coarse && !(sum > limit); ++l) {
            const pack<T> s = shortfall_at(m, &t.value[0][pack_offset(l, m.interior)], limit <= T(0));
            if (any(pack<T>(T(0)) < s)) sum += sum_of(s);
        }
        return sum;
    }
    // Whether the finer instants, and those of failed proofs, are free as well.
    bool finely_free(const motion<T>& m) {
        if (!sane(m)) return false;
        if (p_.base.on) return finely_free_in_space(m);
        const spline_table<T>& t = table(m.interior);
        for (int l = sample_packs_coarse; l < sample_packs_fine; ++l) {
            if (!free_at(m, &t.value[0][pack_offset(l, m.interior)])) return false;
        }
        const std::vector<T>& values = extra_table(m.interior);
        for (std::size_t i = 0; i < extra_.size(); ++i) {
            if (!free_at(m, &values[pack_offset(static_cast<int>(i), m.interior)])) return false;
        }
        return true;
    }
    bool free(const motion<T>& m) { return violation(m, T(0)) <= T(0) && finely_free(m); }

    // Whether the straight way between two configurations is free, at a pack of instants or more, the second end
    // included.
    bool edge_free(const T* from, const T* to) {
        T lane[lanes_of<T>];
        for (int l = 0; l < edge_packs_; ++l) {
            for (int i = 0; i < lanes_of<T>; ++i) lane[i] = static_cast<T>(i + 1 - gap_filler(l)) / T(lanes_of<T>);
            const pack<T> share = pack<T>::load(lane);
            for (int d = 0; d < p_.dofs(); ++d) q_[d] = share * (to[d] - from[d]) + from[d];
            if (any(pack<T>(T(0)) < look(true))) return false;
        }
        return true;
    }

    const spline_table<T>& table(int interior) {
        if (interior >= static_cast<int>(tables_.size())) tables_.resize(interior + 1);
        if (!tables_[interior]) tables_[interior] = spline_table_of<T>(interior);
        return *tables_[interior];
    }
    const motion_problem<T>& problem() const { return p_; }

    // ---- a floating base --------------------------------------------------------------------------------------------
    // The base along a motion, at so many nodes.
    const base_track<T>& follow(const motion<T>& m, int nodes, bool keep_frames) {
        constexpr int W = lanes_of<T>;
        const int packs = std::max(nodes, 16) / W, K = m.interior, n = p_.dofs();
        configurations += nodes;
        track_.follow(K, packs, p_.base.momentum, keep_frames, [&](int k, int d) {
            return k == 0 ? p_.start[d] : k == K + 1 ? p_.end(m)[d] : m.points[static_cast<std::size_t>(k - 1) * n + d];
        });
        return track_;
    }
    // Moves control points until the ends are met; false if they cannot be. Only the end's own row, if it is free, and
    // those between.
    bool settle(motion<T>& m) {
        return settle(m, solver_, [] { return true; });
    }
    template <class GoOn> bool settle(motion<T>& m, end_solver<T>& solver, GoOn&& go_on) {
        const end_goals& ends = p_.base.ends;
        if (!p_.base.on || !ends.any()) return true;
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
        const bool met = solver.solve(
            x, lower, upper, ends.count(), sizeof(T) == 4 ? 0.2 : 1e-4,
            [&](const std::vector<T>& at, bool roughly) {
                write(at, tried);
                ++looks;
                return end_of_track(ends, follow(tried, roughly ? end_nodes / 2 : end_nodes, false));
            },
            go_on);
        write(x, m);
        return met;
    }
    void forget_slopes() { solver_.forget(); }
    end_solver<T>& solver() { return solver_; }

  private:
    static constexpr T infinity = std::numeric_limits<T>::infinity();
    static constexpr int end_nodes = sizeof(T) == 4 ? 64 : 256;  // measured: docs/theory.md
    static constexpr int coarse_nodes = 64;
    static constexpr T in_time =
        T(0.98);  // of a duration asked for: the hulls' bound, which is kept, is a little longer than what instants say

    const std::vector<T>& extra_table(int interior) {
        std::vector<T>& values = extra_tables_[interior];
        while (values.size() < pack_offset(static_cast<int>(extra_.size()), interior)) {
            append_instants(values, interior, 0, extra_[values.size() / pack_offset(1, interior)]);
        }
        return values;
    }

    // The arm and the base where they are, at pack l of the track.
    pack<T> shortfall_in_space(const base_track<T>& track, int l, T margin, bool stop_early) {
        const frame<T>* local = track.frames(l);
        for (std::size_t j = 0; j < work_.frames.size(); ++j)
            put(track.base(l), local[j], p_.scene.shown[j], work_.frames[j]);
        body_.base = &track.base(l);
        const pack<T> out =
            shortfall(p_.scene.envelope, work_.frames.data(), p_.scene.obstacles, margin, body_, stop_early);
        body_.base = nullptr;
        return out;
    }
    T greatest_arm(const base_track<T>& track) const {
        pack<T> most(T(0));
        for (int l = 0; l < track.packs(); ++l) most = max(most, dot(track.arm_momentum(l), track.arm_momentum(l)));
        return std::sqrt(greatest_of(most));
    }
    T greatest_rate(const base_track<T>& track) const {
        pack<T> most(T(0));
        for (int l = 0; l < track.packs(); ++l) most = max(most, dot(track.rate(l), track.rate(l)));
        return std::sqrt(greatest_of(most));
    }
    // The fastest uniform time within all limits, those of the base too.
    T fastest(const motion<T>& m, const base_track<T>& track) {
        const floating_base<T>& b = p_.base;
        T out = duration(m, table(m.interior));
        if (b.most_rate > T(0)) out = std::max(out, greatest_rate(track) / b.most_rate);
        if (b.most_arm > T(0)) out = std::max(out, greatest_arm(track) / b.most_arm);
        return out;
    }
    T time_of(const motion<T>& m, const base_track<T>& track) {
        return p_.base.momentum.duration > T(0) ? p_.base.momentum.duration : fastest(m, track);
    }
    // How far limits are passed, each as a share of itself, and the ends missed.
    T unmet(const motion<T>& m, const base_track<T>& track) {
        const floating_base<T>& b = p_.base;
        T sum = b.ends.any() ? static_cast<T>(end_of_track(b.ends, track).beyond) : T(0);
        if (b.most_turned > T(0)) sum += beyond(T(2 * angle_of_sine(track.greatest_half_sine())), b.most_turned);
        if (b.momentum.duration > T(0)) sum += beyond(fastest(m, track), in_time * b.momentum.duration);
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
    T violation_in_space(const motion<T>& m, T limit) {
        const base_track<T>& track = follow(m, coarse_nodes, true);
        T sum = unmet(m, track);
        if (!(sum <= infinity)) return infinity;
        for (int l = track.packs() - 1; l >= 0 && !(sum > limit); --l) {
            const pack<T> s = shortfall_in_space(track, l, p_.margin, limit <= T(0));
            if (any(pack<T>(T(0)) < s)) sum += sum_of(s);
        }
        return sum;
    }
    bool finely_free_in_space(const motion<T>& m) {
        const base_track<T>& track = follow(m, fine_nodes_, true);
        if (!(unmet(m, track) <= T(0))) return false;
        for (int l = 0; l < track.packs(); ++l) {
            if (any(pack<T>(T(0)) < shortfall_in_space(track, l, p_.margin, true))) return false;
        }
        const std::vector<T>& values = extra_table(m.interior);
        const int all = static_cast<int>(extra_.size());
        for (int k = std::max(0, all - most_extra); k < all;
             ++k) {  // in base coordinates first, then where the base is
            T lane[lanes_of<T>];
            for (int i = 0; i < lanes_of<T>; ++i) lane[i] = static_cast<T>(extra_[k][i]);
            for (int d = 0; d < p_.dofs(); ++d) q_[d] = coordinate(m, &values[pack_offset(k, m.interior)], d);
            forward_kinematics(p_.scene.robot, q_.data(), local_frames());
            rates_.resize(work_.frames.size());
            const momentum_at<T> at =
                momentum_of(p_.scene.robot, p_.scene.masses, q_.data(), local_.data(), rates_.data());
            const frame<T> base = track.base_at(pack<T>::load(lane), at.com, p_.base.momentum);
            for (std::size_t j = 0; j < work_.frames.size(); ++j)
                put(base, local_[j], p_.scene.shown[j], work_.frames[j]);
            body_.base = &base;
            const bool free = !any(pack<T>(T(0)) < shortfall(p_.scene.envelope, work_.frames.data(), p_.scene.obstacles,
                                                             p_.margin, body_, true));
            body_.base = nullptr;
            if (!free) return false;
        }
        return true;
    }
    frame<T>* local_frames() {
        local_.resize(work_.frames.size());
        return local_.data();
    }
    void of_base(const motion<T>& m, T* value) {
        const base_track<T>& track = follow(m, coarse_nodes, false);
        const quaternion q = track.attitude(track.nodes());
        value[term_base_final] = static_cast<T>(2 * angle_of_sine(std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z)));
        value[term_base_peak] = static_cast<T>(2 * angle_of_sine(track.greatest_half_sine()));
        const T inverse = T(1) / std::max(time_of(m, track), std::numeric_limits<T>::min());
        value[term_base_rate] = greatest_rate(track) * inverse;
        value[term_joint_momentum] = greatest_arm(track) * inverse;
    }
    // The seed's terms at a pack of instants, with the points in place.
    void add_seed_terms(const vec3<T>& end, pack<T>* f) const {
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
    // The terms of `carried`, where the arm is in space.
    void carried_in_space(const motion<T>& m, T* value) {
        constexpr int W = lanes_of<T>;
        const base_track<T>& track = follow(m, coarse_nodes, true);
        const int samples = track.nodes(), packs = track.packs();
        std::vector<T> tip[3];
        for (auto& row : tip) row.resize(samples);
        pack<T> comfort(T(0)), f[3] = {pack<T>(T(0)), pack<T>(T(0)), pack<T>(T(0))};
        vec3<T> end{};
        for (int l = packs - 1; l >= 0; --l) {  // the last node is the end
            const pack<T> lacks = shortfall_in_space(track, l, p_.comfort > T(0) ? p_.comfort : T(0), false);
            if (p_.comfort > T(0)) comfort += lacks;
            for (std::size_t i = 0; i < p_.scene.points.size(); ++i) {
                const point<T>& at = p_.scene.points[i];
                work_.points[i] = carry(at.joint < 0 ? track.base(l) : work_.frames[at.joint], at.local);
            }
            const vec3<T>& at = work_.points[p_.tip];
            at.x.store(&tip[0][l * W]);
            at.y.store(&tip[1][l * W]);
            at.z.store(&tip[2][l * W]);
            if (l == packs - 1)
                end = {pack<T>(tip[0][samples - 1]), pack<T>(tip[1][samples - 1]), pack<T>(tip[2][samples - 1])};
            add_seed_terms(end, f);
        }
        value[term_clearance] = sum_of(comfort) / T(samples);
        for (int i = 0; i < 3; ++i) value[term_f1 + i] = sum_of(f[i]) / T(samples);
        const vec3<T> first = tip_at(p_.start.data());
        T sum = 0, before[3], lane[W];
        const pack<T>* begin[3] = {&first.x, &first.y, &first.z};
        for (int k = 0; k < 3; ++k) {
            begin[k]->store(lane);
            before[k] = lane[0];
        }
        for (int i = 0; i < samples; ++i) {
            T squared = 0;
            for (int k = 0; k < 3; ++k) {
                squared += (tip[k][i] - before[k]) * (tip[k][i] - before[k]);
                before[k] = tip[k][i];
            }
            sum += std::sqrt(squared);
        }
        value[term_tip] = sum;
    }

    static std::size_t pack_offset(int l, int interior) {
        return static_cast<std::size_t>(l) * (interior + 2) * lanes_of<T>;
    }

    // One coordinate of the spline, or of a derivative, at a pack of instants.
    SPACEARM_INLINE pack<T> coordinate(const motion<T>& m, const T* basis, int d) const {
        const int K = m.interior, n = p_.dofs(), W = lanes_of<T>;
        pack<T> value = pack<T>::load(basis) * p_.start[d]
                        + pack<T>::load(basis + static_cast<std::size_t>(K + 1) * W) * p_.end(m)[d];
        for (int k = 0; k < K; ++k)
            value += pack<T>::load(basis + static_cast<std::size_t>(k + 1) * W)
                     * m.points[static_cast<std::size_t>(k) * n + d];
        return value;
    }
    pack<T> look(bool stop_early) {
        configurations += lanes_of<T>;
        forward_kinematics(p_.scene.robot, q_.data(), work_.frames.data());
        return shortfall(p_.scene.envelope, work_.frames.data(), p_.scene.obstacles, p_.margin, body_, stop_early);
    }
    pack<T> shortfall_at(const motion<T>& m, const T* basis, bool stop_early) {
        for (int d = 0; d < p_.dofs(); ++d) q_[d] = coordinate(m, basis, d);
        return look(stop_early);
    }
    bool free_at(const motion<T>& m, const T* basis) { return !any(pack<T>(T(0)) < shortfall_at(m, basis, true)); }

    T length(const motion<T>& m, const spline_table<T>& t) const {
        pack<T> sum(T(0));
        for (int l = 0; l < sample_packs_coarse; ++l) {
            pack<T> squared(T(0));
            for (int d = 0; d < p_.dofs(); ++d) {
                const pack<T> v = coordinate(m, &t.value[1][pack_offset(l, m.interior)], d);
                squared += v * v;
            }
            sum += sqrt(squared);
        }
        return sum_of(sum) / T(sample_packs_coarse * lanes_of<T>);
    }
    T duration(const motion<T>& m, const spline_table<T>& t) const {
        T out = 0;
        const std::vector<T>* limits[4] = {nullptr, &p_.velocity, &p_.acceleration, &p_.jerk};
        for (int k = 1; k < 4; ++k) {
            if (limits[k]->empty()) continue;
            pack<T> most(T(0));
            for (int l = 0; l < sample_packs_coarse; ++l) {
                for (int d = 0; d < p_.dofs(); ++d) {
                    most = max(most, abs(coordinate(m, &t.value[k][pack_offset(l, m.interior)], d))
                                         * (T(1) / (*limits[k])[d]));
                }
            }
            const T share = greatest_of(most);
            out = std::max(out, k == 1 ? share : k == 2 ? std::sqrt(share) : static_cast<T>(cube_root(share)));
        }
        return out;
    }
    T smoothness(const motion<T>& m, const spline_table<T>& t) const {
        pack<T> sum(T(0));
        for (int l = 0; l < sample_packs_coarse; ++l) {
            for (int d = 0; d < p_.dofs(); ++d) {
                const pack<T> v = coordinate(m, &t.value[3][pack_offset(l, m.interior)], d);
                sum += v * v;
            }
        }
        return sum_of(sum) / T(sample_packs_coarse * lanes_of<T>);
    }

    // What depends on where the arm is.
    void carried(const motion<T>& m, const spline_table<T>& t, T* value) {
        constexpr int W = lanes_of<T>, samples = sample_packs_coarse * W;
        static_assert(sample_packs_coarse == 2);
        T tip[3][samples];
        pack<T> comfort(T(0)), f[3] = {pack<T>(T(0)), pack<T>(T(0)), pack<T>(T(0))};
        vec3<T> end = tip_at(p_.goal(m.goal));
        for (int l = 0; l < sample_packs_coarse; ++l) {
            for (int d = 0; d < p_.dofs(); ++d) q_[d] = coordinate(m, &t.value[0][pack_offset(l, m.interior)], d);
            configurations += W;
            place(p_.scene, q_.data(), work_);
            if (p_.comfort > T(0)) {
                comfort += shortfall(p_.scene.envelope, work_.frames.data(), p_.scene.obstacles, p_.comfort, body_,
                                     false, false);
            }
            const vec3<T>& at = work_.points[p_.tip];
            at.x.store(&tip[0][l * W]);
            at.y.store(&tip[1][l * W]);
            at.z.store(&tip[2][l * W]);
            add_seed_terms(end, f);
        }
        value[term_clearance] = sum_of(comfort) / T(samples);
        for (int i = 0; i < 3; ++i) value[term_f1 + i] = sum_of(f[i]) / T(samples);
        // The packs interleave: pack 1 holds the instants before those of pack 0. The goal closes the path.
        T before[3], now[3], sum = 0, last[3];
        T lane[W];
        const pack<T>* ends[3] = {&end.x, &end.y, &end.z};
        for (int k = 0; k < 3; ++k) {
            ends[k]->store(lane);
            last[k] = lane[0];
            before[k] = tip[k][W];
        }
        for (int i = 1; i <= samples; ++i) {
            T squared = 0;
            for (int k = 0; k < 3; ++k) {
                now[k] = i == samples ? last[k] : tip[k][(i % 2 ? 0 : W) + i / 2];
                squared += (now[k] - before[k]) * (now[k] - before[k]);
                before[k] = now[k];
            }
            sum += std::sqrt(squared);
        }
        value[term_tip] = sum;
    }
    vec3<T> tip_at(const T* q) {
        for (int d = 0; d < p_.dofs(); ++d) q_[d] = pack<T>(q[d]);
        place(p_.scene, q_.data(), work_);
        return work_.points[p_.tip];
    }

    const motion_problem<T>& p_;
    body_memory<T> body_;
    workspace<T> work_;
    std::vector<pack<T>> q_;
    std::vector<std::shared_ptr<const spline_table<T>>> tables_;
    static constexpr int most_instants = 4096;
    static constexpr int most_extra = 8;
    int packs_ = sample_packs_fine, edge_packs_ = 1;
    int fine_nodes_ = 128;
    base_track<T> track_;
    end_solver<T> solver_;
    std::vector<frame<T>> local_;
    std::vector<spin_and_velocity<T>> rates_;
    std::vector<std::vector<double>> extra_;
    std::map<int, std::vector<T>> extra_tables_;
};

}  // namespace SPACEARM_NAMESPACE
