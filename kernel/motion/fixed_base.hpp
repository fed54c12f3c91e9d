// A base that does not move: the identity, at every instant of every motion.
//
// The instants are those of the spline's tables. Each is looked at when it is asked for, so that a motion that collides
// costs mostly one pack.
#pragma once

#include "motion/base.hpp"

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
        if (m.interior >= static_cast<int>(tables_.size())) tables_.resize(m.interior + 1);
        if (!tables_[m.interior]) tables_[m.interior] = spline_table_of<T>(m.interior);
        values_ = tables_[m.interior]->value[0].data();
        fine_ = density == sampling::fine;
        if (fine_ && !this->added_.empty()) added_values_ = this->added_table(m.interior).data();
    }
    int packs() const override {
        return fine_ ? sample_packs_fine - sample_packs_coarse + static_cast<int>(this->added_.size())
                     : sample_packs_coarse;
    }
    bool repeats_coarse() const override { return false; }
    double instant_at(int pack, int lane) const override {
        const int l = fine_ ? pack + sample_packs_coarse : pack;
        return l < sample_packs_fine ? sample_instant(l, lane, W) : this->added_[l - sample_packs_fine][lane];
    }
    const frame<T>* place(int pack, frame<T>* frames) override {
        const int l = fine_ ? pack + sample_packs_coarse : pack;
        const T* basis = l < sample_packs_fine ? values_ + pack_offset<T>(l, m_->interior)
                                               : added_values_ + pack_offset<T>(l - sample_packs_fine, m_->interior);
        for (int d = 0; d < this->p_.dofs(); ++d) q_[d] = this->p_.coordinate(*m_, basis, d);
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
    const motion<T>* m_ = nullptr;
    const T *values_ = nullptr, *added_values_ = nullptr;
    bool fine_ = false;
    int packs_ = sample_packs_fine;  // of all instants, but those around failed proofs
    std::vector<pack<T>> q_;
    std::vector<std::shared_ptr<const spline_table<T>>> tables_;
    std::vector<instant> path_;
    search_hints hints_;
};

}  // namespace SPACEARM_NAMESPACE
