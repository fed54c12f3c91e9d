// The particle swarm: positions are asked for, their fitness and violation are told, round after round.
//
// One engine serves every caller: the native search fills the packs with its own objective, a Python function is asked
// through the same two steps. Particles lie side by side in memory, one row a dimension, so a step works on packs.
//
//   PSO          eq. (13), inertia weight constant or falling (eq. (14)), global best or a ring of neighbours
//   symbiotic    IPSO variant M: two slave populations, a master that follows its own and the slaves' best
//   cooperative  IPSO variant S: two searching populations, a third driven by their velocities
//   evolving     two searching populations, a third that recombines the personal bests of all (evolution.hpp)
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "random.hpp"

namespace SPACEARM_NAMESPACE {

enum class swarm_variant { pso, symbiotic, cooperative, evolving };
enum class bounds_rule { absorb, reflect, periodic };

struct swarm_settings {
    int particles = 300;
    int rounds = 100;             // the length of the schedules; asking on beyond it keeps their last values
    swarm_variant variant = swarm_variant::pso;
    double inertia_start = 0.5, inertia_end = 0.5;
    double cognitive = 2, social = 2, cooperation = 2;   // c1, c2, c3
    double velocity_clamp = 0;    // share of each dimension's range; 0 leaves velocities free
    double start_velocity = 0.2;  // the first velocities are uniform in +- this share of the range
    int ring = 0;                 // neighbours to either side whose best is followed; 0: the population's best
    bounds_rule bounds = bounds_rule::absorb;
    bool penalty = false;         // fitness + penalty_weight * violation, instead of feasible first
    double penalty_weight = 0;
    double tolerance_share = 0;   // violation forgiven at first: this quantile of the first round's; 0 forgives none
    double tolerance_rounds = 0.5;// by this share of the rounds it has fallen to 0
    double tolerance_power = 5;
    double evolving_share = 0;    // evolving: the share of the particles in population 3
    double elite_share = 0.1;     // evolving: population 3 steers towards one of this best share
    int shrink_to = 0;            // evolving: population 3 shrinks linearly to this many; 0 keeps it
};

// A candidate's worth. Feasible first: less violation wins, then less fitness.
template <class T> struct merit {
    T violation, fitness;
    bool better_than(const merit& other) const {
        return violation < other.violation || (violation == other.violation && fitness < other.fitness);
    }
};

template <class T> class swarm {
  public:
    static constexpr int W = lanes_of<T>;
    static constexpr T infinity = std::numeric_limits<T>::infinity();

    swarm(const swarm_settings& settings, std::vector<T> lower, std::vector<T> upper, std::uint64_t seed, std::uint32_t trial)
        : settings_(settings), dims_(static_cast<int>(lower.size())), lower_(std::move(lower)), upper_(std::move(upper)),
          seed_(seed), trial_(trial) {
        const int n = settings_.particles;
        stride_ = (n + W - 1) / W * W;
        split_populations();
        const std::size_t all = static_cast<std::size_t>(dims_) * stride_;
        x_.assign(all, T(0));
        v_.assign(all, T(0));
        px_.assign(all, T(0));
        social_.assign(all, T(0));
        fitness_.assign(stride_, infinity);
        violation_.assign(stride_, infinity);
        best_fitness_.assign(stride_, infinity);
        best_violation_.assign(stride_, infinity);
        guide_.assign(stride_, 0);
        best_x_.assign(dims_, T(0));
        if (settings_.variant == swarm_variant::symbiotic) {
            social2_.assign(all, T(0));
            weight1_.assign(stride_, T(settings_.social));
            weight2_.assign(stride_, T(0));
        }
        if (settings_.variant == swarm_variant::cooperative) carried_.assign(all, T(0));
    }

    int particles() const { return settings_.particles; }
    int dims() const { return dims_; }
    int stride() const { return stride_; }
    int round() const { return round_; }
    const T* positions() const { return x_.data(); }   // row d, particle i: positions()[d * stride() + i]
    T* positions() { return x_.data(); }
    const swarm_settings& settings() const { return settings_; }
    merit<T> best() const { return best_; }
    const std::vector<T>& best_position() const { return best_x_; }
    std::size_t failed_evaluations() const { return failed_; }
    T tolerance() const { return tolerance_; }

    // The next positions, in place. Every ask is followed by a tell.
    void ask() {
        if (round_ == 0) start();
        else step();
    }

    // Known good positions, in place of the first random ones.
    void place_first(const std::vector<std::vector<T>>& rows) {
        for (std::size_t i = 0; i < rows.size() && i < static_cast<std::size_t>(settings_.particles); ++i) {
            for (int d = 0; d < dims_; ++d) x_[static_cast<std::size_t>(d) * stride_ + i] = rows[i][d];
        }
    }

    // Fitness and violation of the positions asked for. A NaN counts as the worst there is.
    void tell(const T* fitness, const T* violation) {
        const int n = settings_.particles;
        for (int i = 0; i < n; ++i) {
            T f = fitness[i], c = violation[i];
            if (!(f == f) || !(c == c)) {
                f = c = infinity;
                ++failed_;
            }
            fitness_[i] = f;
            violation_[i] = c;
        }
        if (round_ == 0) start_tolerance();
        else lower_tolerance();
        remember();
        ++round_;
    }

    // ---- checkpoints: everything that a later round depends on -------------------------------------------------------
    template <class Visitor> void visit_state(Visitor&& visit) {
        visit("position", x_);
        visit("velocity", v_);
        visit("best_position", px_);
        visit("fitness", fitness_);
        visit("violation", violation_);
        visit("best_fitness", best_fitness_);
        visit("best_violation", best_violation_);
        visit("swarm_best_position", best_x_);
        scalars_ = {best_.violation, best_.fitness, tolerance_, first_tolerance_};
        visit("scalars", scalars_);
        best_.violation = scalars_[0];
        best_.fitness = scalars_[1];
        tolerance_ = scalars_[2];
        first_tolerance_ = scalars_[3];
    }
    void restore_counters(int round, std::size_t failed) {
        round_ = round;
        failed_ = failed;
    }

  private:
    merit<T> judged(T fitness, T violation) const {
        if (settings_.penalty) return {T(0), fitness + T(settings_.penalty_weight) * violation};
        return {violation <= tolerance_ ? T(0) : violation, fitness};
    }

    void split_populations() {
        const int n = settings_.particles;
        first_[0] = 0;
        if (settings_.variant == swarm_variant::pso) {
            first_[1] = first_[2] = first_[3] = n;
            populations_ = 1;
            return;
        }
        populations_ = 3;
        first_[1] = n / 3;
        first_[2] = 2 * (n / 3);
        first_[3] = n;
    }

    int population_of(int i) const { return i < first_[1] ? 0 : i < first_[2] ? 1 : 2; }

    // Round 0: positions uniform within the bounds, velocities in +- a share of the range.
    void start() {
        const random_key where(seed_, trial_, stream::start_position), how(seed_, trial_, stream::start_velocity);
        for (int i = 0; i < stride_; i += W) {
            for (int d = 0; d < dims_; d += 4) {
                pack<T> u[4], s[4];
                uniforms<T>(where, 0, i, d / 4, u);
                uniforms<T>(how, 0, i, d / 4, s);
                for (int k = 0; k < 4 && d + k < dims_; ++k) {
                    const T range = upper_[d + k] - lower_[d + k];
                    const std::size_t at = static_cast<std::size_t>(d + k) * stride_ + i;
                    min(pack<T>(lower_[d + k]) + u[k] * range, pack<T>(upper_[d + k])).store(&x_[at]);
                    ((s[k] + s[k] - T(1)) * (range * T(settings_.start_velocity))).store(&v_[at]);
                }
            }
        }
    }

    T inertia() const {   // eq. (14)
        const double t = std::min(1.0, static_cast<double>(round_) / std::max(1, settings_.rounds));
        return static_cast<T>(settings_.inertia_start - (settings_.inertia_start - settings_.inertia_end) * t);
    }

    // Whose personal best each particle follows.
    void choose_guides() {
        const int k = settings_.ring;
        for (int p = 0; p < populations_; ++p) {
            const int begin = first_[p], size = first_[p + 1] - begin;
            if (k <= 0 || 2 * k + 1 >= size) {
                for (int i = 0; i < size; ++i) guide_[begin + i] = leader_[p];
                continue;
            }
            for (int i = 0; i < size; ++i) {
                int best = begin + i;
                for (int o = -k; o <= k; ++o) {
                    const int other = begin + (i + o + size) % size;
                    if (personal(other).better_than(personal(best))) best = other;
                }
                guide_[begin + i] = best;
            }
        }
    }

    merit<T> personal(int i) const { return judged(best_fitness_[i], best_violation_[i]); }

    void prepare_social() {
        choose_guides();
        const int n = settings_.particles;
        for (int d = 0; d < dims_; ++d) {
            const T* from = &px_[static_cast<std::size_t>(d) * stride_];
            T* to = &social_[static_cast<std::size_t>(d) * stride_];
            for (int i = 0; i < n; ++i) to[i] = from[guide_[i]];
        }
    }

    // Variant M: the master weighs its own best against the slaves' best: Phi = 0, 1/2, 1 as f(gS) <, =, > f(gM).
    void prepare_symbiotic() {
        const int slave = personal(leader_[1]).better_than(personal(leader_[0])) ? leader_[1] : leader_[0];
        const merit<T> master = personal(leader_[2]), slaves = personal(slave);
        const double phi = slaves.better_than(master) ? 0.0 : master.better_than(slaves) ? 1.0 : 0.5;
        for (int i = first_[2]; i < first_[3]; ++i) {
            weight1_[i] = static_cast<T>(phi * settings_.social);
            weight2_[i] = static_cast<T>((1 - phi) * settings_.cooperation);
            for (int d = 0; d < dims_; ++d) {
                const std::size_t row = static_cast<std::size_t>(d) * stride_;
                social2_[row + i] = px_[row + slave];
            }
        }
    }

    // Variant S: the velocity that population 3 carries on is (G/G1) v1 + (G/G2) v2 + v3, with G = G1 + G2.
    void prepare_cooperative() {
        carried_ = v_;
        const int size = first_[1];
        for (int i = first_[2]; i < first_[3]; ++i) {
            const int one = (i - first_[2]) % size, two = first_[1] + one;
            const T g1 = fitness_[one], g2 = fitness_[two], g = g1 + g2;
            const T a = g / g1, b = g / g2;
            if (!std::isfinite(a) || !std::isfinite(b)) continue;   // a failed evaluation drives nobody
            for (int d = 0; d < dims_; ++d) {
                const std::size_t row = static_cast<std::size_t>(d) * stride_;
                carried_[row + i] = a * v_[row + one] + b * v_[row + two] + v_[row + i];
            }
        }
    }

    void step() {
        prepare_social();
        if (settings_.variant == swarm_variant::symbiotic) prepare_symbiotic();
        if (settings_.variant == swarm_variant::cooperative) prepare_cooperative();
        const random_key key(seed_, trial_, stream::velocity);
        const pack<T> w(inertia()), c1(T(settings_.cognitive)), c2(T(settings_.social));
        const bool symbiotic = settings_.variant == swarm_variant::symbiotic;
        const std::vector<T>& momentum = settings_.variant == swarm_variant::cooperative ? carried_ : v_;
        for (int i = 0; i < stride_; i += W) {
            for (int d = 0; d < dims_; d += 2) {
                pack<T> r[4], r3[4];
                uniforms<T>(key, round_, i, d / 2, r);
                if (symbiotic && d % 4 == 0) uniforms<T>(key, round_, i, 0x10000u + d / 4, r3);
                for (int k = 0; k < 2 && d + k < dims_; ++k) {
                    const std::size_t at = static_cast<std::size_t>(d + k) * stride_ + i;
                    const pack<T> x = pack<T>::load(&x_[at]);
                    pack<T> v = w * pack<T>::load(&momentum[at])                                        // eq. (13)
                              + c1 * r[2 * k] * (pack<T>::load(&px_[at]) - x);
                    if (!symbiotic) {
                        v += c2 * r[2 * k + 1] * (pack<T>::load(&social_[at]) - x);
                    } else {
                        v += pack<T>::load(&weight1_[i]) * r[2 * k + 1] * (pack<T>::load(&social_[at]) - x);
                        v += pack<T>::load(&weight2_[i]) * third(r3, d, k) * (pack<T>::load(&social2_[at]) - x);
                    }
                    move(d + k, at, x, v);
                }
            }
        }
    }

    // r3 is drawn four dimensions at a time, the pairs of a step two: the second pair uses the second half.
    static SPACEARM_INLINE const pack<T>& third(const pack<T> (&r3)[4], int d, int k) { return r3[d % 4 + k]; }

    SPACEARM_INLINE void move(int d, std::size_t at, const pack<T>& x, pack<T> v) {
        const T lo = lower_[d], hi = upper_[d], range = hi - lo;
        if (settings_.velocity_clamp > 0) {
            const pack<T> most(range * T(settings_.velocity_clamp));
            v = clamp(v, -most, most);
        }
        pack<T> to = x + v;
        const pack<T> low(lo), high(hi);
        const pack_mask<T> outside = (to < low) | (high < to);
        if (any(outside)) {
            const pack<T> inside = clamp(to, low, high);
            if (settings_.bounds == bounds_rule::absorb) {
                v = select(outside, pack<T>(T(0)), v);
                to = inside;
            } else if (settings_.bounds == bounds_rule::reflect) {
                v = select(outside, -v, v);
                to = clamp(inside + inside - to, low, high);
            } else {
                const pack<T> turns = range > T(0) ? nearest((to - low) / range - T(0.5)) : pack<T>(T(0));
                to = clamp(to - turns * range, low, high);
            }
        }
        v.store(&v_[at]);
        to.store(&x_[at]);
    }

    void start_tolerance() {
        tolerance_ = first_tolerance_ = T(0);
        if (settings_.tolerance_share <= 0 || settings_.penalty) return;
        std::vector<T> sorted(violation_.begin(), violation_.begin() + settings_.particles);
        const std::size_t k = std::min<std::size_t>(sorted.size() - 1, static_cast<std::size_t>(settings_.tolerance_share * sorted.size()));
        std::nth_element(sorted.begin(), sorted.begin() + k, sorted.end());
        tolerance_ = first_tolerance_ = std::isfinite(sorted[k]) ? sorted[k] : T(0);
    }

    // Forgiven violation, falling as (1 - t/T)^power (Takahama and Sakai 2006).
    void lower_tolerance() {
        if (first_tolerance_ <= T(0)) return;
        const double until = settings_.tolerance_rounds * settings_.rounds;
        const double left = 1.0 - round_ / std::max(1.0, until);
        tolerance_ = left <= 0 ? T(0) : first_tolerance_ * static_cast<T>(std::pow(left, settings_.tolerance_power));
    }

    // Personal bests, the populations' leaders, and the best of all, which is never judged with forgiveness.
    void remember() {
        const int n = settings_.particles;
        for (int i = 0; i < n; ++i) {
            if (!judged(fitness_[i], violation_[i]).better_than(personal(i))) continue;
            best_fitness_[i] = fitness_[i];
            best_violation_[i] = violation_[i];
            for (int d = 0; d < dims_; ++d) {
                const std::size_t at = static_cast<std::size_t>(d) * stride_ + i;
                px_[at] = x_[at];
            }
        }
        int found = -1;
        for (int i = 0; i < n; ++i) {
            const merit<T> now = settings_.penalty ? judged(fitness_[i], violation_[i]) : merit<T>{violation_[i], fitness_[i]};
            const merit<T> champion = settings_.penalty ? judged(best_.fitness, best_.violation) : best_;
            if (now.better_than(champion)) {
                best_ = {violation_[i], fitness_[i]};
                found = i;
            }
        }
        if (found >= 0) {
            for (int d = 0; d < dims_; ++d) best_x_[d] = x_[static_cast<std::size_t>(d) * stride_ + found];
        }
        find_leaders();
    }

    void find_leaders() {
        for (int p = 0; p < populations_; ++p) {
            int best = first_[p];
            for (int i = first_[p]; i < first_[p + 1]; ++i) {
                if (personal(i).better_than(personal(best))) best = i;
            }
            leader_[p] = best;
        }
    }

    swarm_settings settings_;
    int dims_, stride_ = 0, populations_ = 1;
    int first_[4] = {}, leader_[3] = {};
    std::vector<T> lower_, upper_;
    std::uint64_t seed_;
    std::uint32_t trial_;
    int round_ = 0;
    std::size_t failed_ = 0;
    T tolerance_ = 0, first_tolerance_ = 0;
    merit<T> best_{infinity, infinity};
    std::vector<T> x_, v_, px_, social_, social2_, weight1_, weight2_, carried_;
    std::vector<T> fitness_, violation_, best_fitness_, best_violation_, best_x_, scalars_;
    std::vector<int> guide_;
};

}  // namespace SPACEARM_NAMESPACE
