// A base that does not move: the identity, at every instant of every motion.
//
// The instants are those of the spline's tables. Each is looked at when it is asked for, so that a motion that collides
// costs mostly one pack. Where a motion is so fast that the fine instants are further apart than those of an edge, they
// lie evenly along its length instead, and are as many as that takes. So do those of a motion of many control points.
#pragma once

#include <numeric>

#include "motion/base.hpp"
#include "motion/local_spline.hpp"

namespace SPACEARM_NAMESPACE {

template <class T> class fixed_base final : public base_model<T> {
  public:
    static constexpr int W = lanes_of<T>;

    explicit fixed_base(const motion_problem<T>& problem) : base_model<T>(problem), q_(problem.dofs()) {
        static_assert(sample_packs_coarse == 2);  // they interleave: pack 1 holds the instants before those of pack 0
        for (int i = 0; i < W; ++i) {
            path_.push_back({1, i});
            path_.push_back({0, i});
        }
        path_.push_back({instant::goal});
    }

    void follow(const motion<T>& m, sampling density, bool) override {
        m_ = &m;
        fine_ = density != sampling::coarse;
        const bool dense = density == sampling::dense;
        tabled_ = m.interior <= most_tabled && !dense;
        if (tabled_) {
            if (m.interior >= static_cast<int>(tables_.size())) tables_.resize(m.interior + 1);
            if (!tables_[m.interior]) tables_[m.interior] = spline_table_of<T>(m.interior);
            values_ = tables_[m.interior]->value[0].data();
            if (fine_) tabled_ = !(fastest(m, *tables_[m.interior]) * T(instants_per_unit) > sample_packs_fine * W);
            if (fine_ && tabled_ && !this->added_.empty()) added_values_ = this->added_table(m.interior).data();
        }
        first_ = fine_ ? sample_packs_coarse : 0;
        all_ = fine_ ? sample_packs_fine : sample_packs_coarse;
        if (tabled_) return;
        local_.take(m, this->p_.start.data(), this->p_.end(m), this->p_.dofs());
        if (!fine_) return;
        const T along = local_.measure_lengths() * T(instants_per_unit * this->edge_packs() * (dense ? 4 : 1)) / T(W);
        const T most = T(this->most_instants / W);
        first_ = 0;
        all_ = std::max(sample_packs_fine - sample_packs_coarse, static_cast<int>(std::ceil(std::min(most, along))));
        jump_ = std::max(1, static_cast<int>(0.618 * all_));  // from pack to pack, so that the first are far apart
        while (std::gcd(jump_, all_) > 1) ++jump_;
    }
    int packs() const override { return all_ - first_ + (fine_ ? static_cast<int>(this->added_.size()) : 0); }
    bool repeats_coarse() const override { return false; }
    double instant_at(int pack, int lane) const override {
        const int l = pack + first_;
        if (l >= all_) return this->added_[l - all_][lane];
        return tabled_ || !fine_ ? sample_instant(l, lane, W) : double(position(l, lane)) / (m_->interior + 1);
    }
    const frame<T>* place(int pack, frame<T>* frames) override {
        const int l = pack + first_;
        if (tabled_) {
            const T* basis = l < all_ ? values_ + pack_offset<T>(l, m_->interior)
                                      : added_values_ + pack_offset<T>(l - all_, m_->interior);
            for (int d = 0; d < this->p_.dofs(); ++d) q_[d] = this->p_.coordinate(*m_, basis, d);
        } else {
            T at[W];
            for (int i = 0; i < W; ++i) at[i] = position(l, i);
            local_.joints(at, q_.data());
        }
        this->configurations += W;
        this->place_joints(q_.data(), frames);
        return nullptr;
    }
    const frame<T>* place_end(frame<T>* frames) override {
        const T* end = this->p_.end(*m_);
        for (int d = 0; d < this->p_.dofs(); ++d) q_[d] = pack<T>(end[d]);
        this->place_joints(q_.data(), frames);
        return nullptr;
    }
    const std::vector<instant>& path() const override { return path_; }

    double final_turn() const override { return 0; }
    double peak_turn() const override { return 0; }
    T rate() const override { return 0; }
    T arm_momentum() const override { return 0; }
    T duration(T fastest) const override { return fastest; }

    // The goal is a configuration, and a motion ends in it.
    terminal_residual missed(const terminal_constraints&) const override { return {}; }
    terminal_residual at_end(const motion<T>&, const terminal_constraints&, bool) override { return {}; }
    void poses(const motion<T>&, int nodes, bool last_only, T* out) override {
        for (int i = 0; i < (last_only ? 1 : nodes + 1); ++i) {
            std::fill(out, out + 7, T(0));
            out[3] = T(1);
            out += 7;
        }
    }

    const search_hints& hints() const override { return hints_; }
    void add_instants(const std::vector<double>& around) override {
        this->added_.push_back(around);
        if (packs_ * W >= this->most_instants) return;
        std::vector<double> instants(W);
        for (int l = packs_; l < 2 * packs_; ++l) {
            for (int i = 0; i < W; ++i) instants[i] = sample_instant(l, i, W);
            this->added_.push_back(instants);
        }
        packs_ *= 2;
        this->edge_packs_ *= 2;
    }

  private:
    // The greatest rate over the coarse instants, per unit of s [rad or m].
    T fastest(const motion<T>& m, const spline_table<T>& t) const {
        pack<T> most(T(0));
        for (int l = 0; l < sample_packs_coarse; ++l) {
            pack<T> squared(T(0));
            for (int d = 0; d < this->p_.dofs(); ++d) {
                const pack<T> v = this->p_.coordinate(m, &t.value[1][pack_offset<T>(l, m.interior)], d);
                squared += v * v;
            }
            most = max(most, squared);
        }
        return std::sqrt(greatest_of(most));
    }
    // Where, in spans, an instant is, of a motion that is looked at span by span.
    T position(int l, int lane) const {
        const T spans = T(m_->interior + 1);
        if (l >= all_) return static_cast<T>(this->added_[l - all_][lane]) * spans;
        if (!fine_) return static_cast<T>(sample_instant(l, lane, W)) * spans;
        const T share = (T(lane) + (T(static_cast<std::int64_t>(l) * jump_ % all_) + T(0.5)) / T(all_)) / T(W);
        return local_.position_at(share);
    }

    const motion<T>* m_ = nullptr;
    const T *values_ = nullptr, *added_values_ = nullptr;
    bool fine_ = false, tabled_ = true;
    int first_ = 0, all_ = 0, jump_ = 1;  // packs: the first of the sampling, all but those added, and the next one's
    int packs_ = sample_packs_fine;       // of all instants of a short motion, but those around failed proofs
    local_spline<T> local_;
    std::vector<pack<T>> q_;
    std::vector<std::shared_ptr<const spline_table<T>>> tables_;
    std::vector<instant> path_;
    search_hints hints_;
};

}  // namespace SPACEARM_NAMESPACE
