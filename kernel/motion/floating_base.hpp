// A base that floats: where it goes while the joints follow a motion.
//
// The rate w(s) = -H^-1 h is known at all nodes of an even grid at once, on packs whose lanes are the nodes. Only the
// attitude is a sequence: the ordered product of the small turns between nodes. Each of these is a Magnus step: the
// integral of w by the polynomial through six nodes, and the commutator of fourth order (Iserles et al., 2000,
// Lie-group methods).
//
// All is told in the frame of the base as it stands at the beginning: there its attitude is the identity and its origin
// 0.
#pragma once

#include "motion/base.hpp"
#include "motion/local_spline.hpp"

namespace SPACEARM_NAMESPACE {

// A spline's basis at the nodes (i + 1) / N, packs of them: values and first derivatives.
template <class T> struct node_table {
    std::vector<T> value[2];
    std::vector<int> first, last;  // of each pack: the control points that count, the last one excluded
};
template <class T> std::shared_ptr<const node_table<T>> node_table_of(int interior, int packs) {
    static std::mutex lock;
    static std::map<std::pair<int, int>, std::shared_ptr<const node_table<T>>> known;
    std::lock_guard<std::mutex> hold(lock);
    auto& entry = known[{interior, packs}];
    if (!entry) {
        constexpr int W = lanes_of<T>;
        node_table<T> t;
        for (int derivative = 0; derivative < 2; ++derivative) {
            for (int l = 0; l < packs; ++l) {
                std::vector<double> instants;
                for (int lane = 0; lane < W; ++lane) instants.push_back((l * W + lane + 1.0) / (packs * W));
                append_instants(t.value[derivative], interior, derivative, instants);
                if (derivative > 0) continue;
                t.first.push_back(
                    std::clamp(span_of(instants.front() * (interior + 1), interior) - 2, 0, interior + 1));
                t.last.push_back(std::min(span_of(instants.back() * (interior + 1), interior) + 4, interior + 2));
            }
        }
        entry = std::make_shared<const node_table<T>>(std::move(t));
    }
    return entry;
}

// The integration: the base at the nodes of an even grid.
template <class T> class floating_track {
  public:
    static constexpr int W = lanes_of<T>;

    explicit floating_track(const model<T>& scene)
        : m_(scene), rates_(scene.robot.joints.size()), q_(scene.robot.dofs), dq_(scene.robot.dofs) {}

    // control(k, d): the motion's control point k, 0 the start and K + 1 the end. With `keep_frames` the joints' frames
    // at all nodes stay, in the base frame.
    template <class Control>
    void follow(int interior, int packs, const constant_momentum<T>& momentum, bool keep_frames, Control&& control) {
        constexpr int margin = 2;  // nodes beyond either end, by extrapolation
        if (packs != packs_) resize(packs);
        const int n = m_.robot.dofs, joints = static_cast<int>(m_.robot.joints.size());
        if (!tables_ || interior != interior_) tables_ = node_table_of<T>(interior, packs);
        interior_ = interior;
        with_frames_ = keep_frames;
        frames_.resize(static_cast<std::size_t>(keep_frames ? packs : 1) * joints);
        start(control, momentum, n);
        for (int l = 0; l < packs; ++l) {
            const std::size_t at = static_cast<std::size_t>(l) * (interior + 2) * W;
            for (int d = 0; d < n; ++d) {
                pack<T> q(T(0)), dq(T(0));
                for (int k = tables_->first[l]; k < tables_->last[l]; ++k) {
                    const T c = control(k, d);
                    q += pack<T>::load(&tables_->value[0][at + k * W]) * c;
                    dq += pack<T>::load(&tables_->value[1][at + k * W]) * c;
                }
                q_[d] = q;
                dq_[d] = dq;
            }
            frame<T>* frames = &frames_[static_cast<std::size_t>(keep_frames ? l : 0) * joints];
            forward_kinematics(m_.robot, q_.data(), frames);
            const momentum_at<T> at_nodes = momentum_of(m_.robot, m_.masses, dq_.data(), frames, rates_.data());
            com_[l] = at_nodes.com;
            arm_[l] = at_nodes.arm;
            if (momentum.any) inertia_[l] = at_nodes.inertia;
            const vec3<T> w = solved(at_nodes.inertia, at_nodes.arm);
            (-w.x).store(&own_[0][margin + 1 + l * W]);
            (-w.y).store(&own_[1][margin + 1 + l * W]);
            (-w.z).store(&own_[2][margin + 1 + l * W]);
        }
        for (int k = 0; k < 3; ++k) own_[k][margin] = 0;  // at rest
        if (!momentum.any) integrate(own_);
        else with_momentum(momentum);
        place(momentum);
    }

    int nodes() const { return packs_ * W; }
    int packs() const { return packs_; }
    const frame<T>* frames(int l) const {
        return &frames_[static_cast<std::size_t>(with_frames_ ? l : 0) * m_.robot.joints.size()];
    }
    const frame<T>& base(int l) const { return base_[l]; }           // where the base is
    const vec3<T>& com(int l) const { return com_[l]; }              // of the system, in the base frame
    const vec3<T>& arm_momentum(int l) const { return arm_[l]; }     // per unit of s
    quaternion attitude(int node) const { return attitude_[node]; }  // 0 the beginning
    vec3<T> rate(int l) const {                                      // per unit of s, base axes
        return {pack<T>::load(&rate_[0][3 + l * W]), pack<T>::load(&rate_[1][3 + l * W]),
                pack<T>::load(&rate_[2][3 + l * W])};
    }
    // Sine of half the angle that the base has turned by, the greatest over all nodes.
    double greatest_half_sine() const {
        double most = 0;
        for (int i = 1; i <= nodes(); ++i) {
            const quaternion& q = attitude_[i];
            const double squared = q.x * q.x + q.y * q.y + q.z * q.z;
            if (!(squared <= most)) most = squared;  // a NaN is the greatest, and stays
            if (most != most) return most;
        }
        return most < 1 ? std::sqrt(most) : 1;
    }
    // The base at any instant between nodes, given the system's centre of mass there.
    frame<T> base_at(const pack<T>& s, const vec3<T>& com, const constant_momentum<T>& momentum) const {
        T lane[W], quat[4][W];
        s.store(lane);
        for (int i = 0; i < W; ++i) {
            const double at = double(lane[i]) * nodes();
            const int node = std::clamp(static_cast<int>(at), 0, nodes() - 1);
            const double share = at - node;
            const quaternion &a = attitude_[node], &b = attitude_[node + 1];  // nearly the same: along the chord
            const double sign = a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z < 0 ? -1 : 1;
            quat[0][i] = static_cast<T>(a.w + (sign * b.w - a.w) * share);
            quat[1][i] = static_cast<T>(a.x + (sign * b.x - a.x) * share);
            quat[2][i] = static_cast<T>(a.y + (sign * b.y - a.y) * share);
            quat[3][i] = static_cast<T>(a.z + (sign * b.z - a.z) * share);
        }
        frame<T> out;
        columns(pack<T>::load(quat[0]), pack<T>::load(quat[1]), pack<T>::load(quat[2]), pack<T>::load(quat[3]), out);
        set_origin(out, com, s, momentum);
        return out;
    }

  private:
    void resize(int packs) {
        packs_ = packs;
        tables_.reset();
        com_.resize(packs);
        arm_.resize(packs);
        base_.resize(packs);
        inertia_.resize(packs);
        attitude_.resize(packs * W + 1);
        for (int k = 0; k < 3; ++k) {
            own_[k].assign(packs * W + 5 + W, T(0));  // [2 + i] is node i
            rate_[k].assign(packs * W + 5 + W, T(0));
            turn_[k].assign(packs * W, T(0));
        }
    }
    // Where the centre of mass is at the beginning, and what the momentum turns the base by there.
    template <class Control> void start(Control&& control, const constant_momentum<T>& momentum, int n) {
        bool same = static_cast<int>(from_.size()) == n && had_momentum_ == momentum.any;
        for (int d = 0; same && d < n; ++d) same = from_[d] == control(0, d);
        if (same) return;
        had_momentum_ = momentum.any;
        from_.resize(n);
        for (int d = 0; d < n; ++d) {
            from_[d] = control(0, d);
            q_[d] = pack<T>(from_[d]);
            dq_[d] = pack<T>(T(0));
        }
        std::vector<frame<T>> frames(m_.robot.joints.size());
        forward_kinematics(m_.robot, q_.data(), frames.data());
        const momentum_at<T> at = momentum_of(m_.robot, m_.masses, dq_.data(), frames.data(), rates_.data());
        T lane[W];
        const pack<T>* c[3] = {&at.com.x, &at.com.y, &at.com.z};
        for (int k = 0; k < 3; ++k) {
            c[k]->store(lane);
            center_[k] = lane[0];
        }
        if (!momentum.any) return;
        const vec3<T> w = solved(at.inertia, constant(momentum.angular));
        const pack<T>* r[3] = {&w.x, &w.y, &w.z};
        for (int k = 0; k < 3; ++k) {
            r[k]->store(lane);
            first_rate_[k] = lane[0] * momentum.duration;
        }
    }

    // From the rates at the nodes to the turns between them, and to the attitudes.
    void integrate(const std::vector<T> (&rate)[3]) {
        const int N = nodes();
        for (int k = 0; k < 3; ++k) {
            if (&rate[k] != &rate_[k]) std::copy(rate[k].begin(), rate[k].end(), rate_[k].begin());
            T* f = &rate_[k][2];
            f[-1] = 6 * f[0] - 15 * f[1] + 20 * f[2] - 15 * f[3] + 6 * f[4] - f[5];
            f[-2] = 6 * f[-1] - 15 * f[0] + 20 * f[1] - 15 * f[2] + 6 * f[3] - f[4];
            f[N + 1] = 6 * f[N] - 15 * f[N - 1] + 20 * f[N - 2] - 15 * f[N - 3] + 6 * f[N - 4] - f[N - 5];
            f[N + 2] = 6 * f[N + 1] - 15 * f[N] + 20 * f[N - 1] - 15 * f[N - 2] + 6 * f[N - 3] - f[N - 4];
        }
        const T h = T(1) / T(N), outer = h * T(11.0 / 1440), middle = h * T(-93.0 / 1440), inner = h * T(802.0 / 1440),
                twist = h * h / T(12);
        for (int i = 0; i < N; i += W) {
            pack<T> v[3], a[3], b[3];
            for (int k = 0; k < 3; ++k) {
                const T* f = &rate_[k][i];
                a[k] = pack<T>::load(f + 2);
                b[k] = pack<T>::load(f + 3);
                v[k] = (pack<T>::load(f) + pack<T>::load(f + 5)) * outer
                       + (pack<T>::load(f + 1) + pack<T>::load(f + 4)) * middle + (a[k] + b[k]) * inner;
            }
            const vec3<T> c = cross(vec3<T>{a[0], a[1], a[2]}, vec3<T>{b[0], b[1], b[2]});
            (v[0] + c.x * twist).store(&turn_[0][i]);
            (v[1] + c.y * twist).store(&turn_[1][i]);
            (v[2] + c.z * twist).store(&turn_[2][i]);
        }
        attitude_[0] = {};
        for (int i = 0; i < N; ++i) {
            const double x = turn_[0][i], y = turn_[1][i], z = turn_[2][i], half = (x * x + y * y + z * z) / 4;
            double c, s;  // cosine, and sine over the angle, of half the turn
            if (half < 0.01) {
                c = 1 - half / 2 * (1 - half / 12 * (1 - half / 30));
                s = 0.5 * (1 - half / 6 * (1 - half / 20 * (1 - half / 42)));
            } else {
                const double angle = std::sqrt(half);
                sincos(angle, s, c);
                s = 0.5 * s / angle;
            }
            attitude_[i + 1] = attitude_[i] * quaternion{c, x * s, y * s, z * s};
        }
    }
    // The momentum is constant in space, so what it turns the base by depends on the attitude: again and again, from
    // the last attitudes, until they stay; within 40 rounds they do for up to some 20 rad.
    void with_momentum(const constant_momentum<T>& momentum) {
        const int N = nodes();
        for (int i = 0; i <= N; ++i) attitude_[i] = {};
        std::vector<quaternion> before;
        for (int round = 0; round < 40; ++round) {
            before = attitude_;
            for (int k = 0; k < 3; ++k) rate_[k][2] = first_rate_[k];
            for (int l = 0; l < packs_; ++l) {
                set_columns(l);
                const frame<T>& R = base_[l];
                const vec3<T> L = constant(momentum.angular);
                const vec3<T> w =
                    solved(inertia_[l], vec3<T>{dot(R.column[0], L), dot(R.column[1], L), dot(R.column[2], L)});
                const pack<T>* r[3] = {&w.x, &w.y, &w.z};
                for (int k = 0; k < 3; ++k)
                    (pack<T>::load(&own_[k][3 + l * W]) + *r[k] * momentum.duration).store(&rate_[k][3 + l * W]);
            }
            integrate(rate_);
            double most = 0;
            for (int i = 0; i <= N; ++i) {
                const quaternion d = conjugate(before[i]) * attitude_[i];
                most = std::max(most, d.x * d.x + d.y * d.y + d.z * d.z);
            }
            if (most
                < 1e-3 * double(std::numeric_limits<T>::epsilon()) * double(std::numeric_limits<T>::epsilon()) + 1e-26)
                break;
        }
    }
    static SPACEARM_INLINE void columns(const pack<T>& w, const pack<T>& x, const pack<T>& y, const pack<T>& z,
                                        frame<T>& out) {
        const pack<T> s = pack<T>(T(2)) / (w * w + x * x + y * y + z * z), one(T(1));
        const pack<T> xs = x * s, ys = y * s, zs = z * s;
        out.column[0] = {one - (y * ys + z * zs), x * ys + w * zs, x * zs - w * ys};
        out.column[1] = {x * ys - w * zs, one - (x * xs + z * zs), y * zs + w * xs};
        out.column[2] = {x * zs + w * ys, y * zs - w * xs, one - (x * xs + y * ys)};
    }
    void set_columns(int l) {
        T q[4][W];
        for (int i = 0; i < W; ++i) {
            const quaternion& a = attitude_[l * W + i + 1];
            q[0][i] = static_cast<T>(a.w);
            q[1][i] = static_cast<T>(a.x);
            q[2][i] = static_cast<T>(a.y);
            q[3][i] = static_cast<T>(a.z);
        }
        columns(pack<T>::load(q[0]), pack<T>::load(q[1]), pack<T>::load(q[2]), pack<T>::load(q[3]), base_[l]);
    }
    // The centre of mass stays, or drifts: so the base's origin follows from it.
    void set_origin(frame<T>& f, const vec3<T>& c, const pack<T>& s, const constant_momentum<T>& momentum) const {
        f.origin = {pack<T>(center_[0]) - (f.column[0].x * c.x + f.column[1].x * c.y + f.column[2].x * c.z),
                    pack<T>(center_[1]) - (f.column[0].y * c.x + f.column[1].y * c.y + f.column[2].y * c.z),
                    pack<T>(center_[2]) - (f.column[0].z * c.x + f.column[1].z * c.y + f.column[2].z * c.z)};
        if (!momentum.any) return;
        f.origin.x += s * momentum.drift[0];
        f.origin.y += s * momentum.drift[1];
        f.origin.z += s * momentum.drift[2];
    }
    void place(const constant_momentum<T>& momentum) {
        T lane[W];
        for (int l = 0; l < packs_; ++l) {
            set_columns(l);
            for (int i = 0; i < W; ++i) lane[i] = T(l * W + i + 1) / T(nodes());
            set_origin(base_[l], com_[l], pack<T>::load(lane), momentum);
        }
    }

    const model<T>& m_;
    std::shared_ptr<const node_table<T>> tables_;
    std::vector<spin_and_velocity<T>> rates_;
    std::vector<pack<T>> q_, dq_;
    int packs_ = 0, interior_ = -1;
    bool with_frames_ = false, had_momentum_ = false;
    std::vector<frame<T>> frames_, base_;
    std::vector<vec3<T>> com_, arm_;
    std::vector<symmetric3<T>> inertia_;
    std::vector<T> own_[3], rate_[3], turn_[3];
    std::vector<quaternion> attitude_;
    std::vector<T> from_;
    T center_[3] = {}, first_rate_[3] = {};
};

template <class T> class floating_base final : public base_model<T> {
  public:
    static constexpr int W = lanes_of<T>;

    explicit floating_base(const motion_problem<T>& problem)
        : base_model<T>(problem), track_(problem.scene), q_(problem.dofs()), local_(problem.scene.robot.joints.size()),
          rates_(local_.size()) {
        path_.push_back({instant::start});
        for (int i = 0; i < coarse_nodes; ++i) path_.push_back({coarse_nodes / W - 1 - i / W, i % W});
    }

    void follow(const motion<T>& m, sampling density, bool with_frames) override {
        m_ = &m;
        fine_ = density != sampling::coarse;
        follow(m, fine_ ? fine_nodes(m) : coarse_nodes, with_frames);
        const int all = static_cast<int>(this->added_.size());
        first_added_ = std::max(0, all - most_added);
        if (fine_ && all > 0) added_values_ = this->added_table(m.interior).data();
    }
    int packs() const override {
        return track_.packs() + (fine_ ? static_cast<int>(this->added_.size()) - first_added_ : 0);
    }
    bool repeats_coarse() const override { return true; }
    double instant_at(int pack, int lane) const override {
        const int l = track_.packs() - 1 - pack;
        return l < 0 ? this->added_[first_added_ - 1 - l][lane] : (l * W + lane + 1.0) / track_.nodes();
    }
    // The packs of the track, the end first, for there it mostly collides; then those between its nodes.
    const frame<T>* place(int pack, frame<T>* frames) override {
        const int l = track_.packs() - 1 - pack;
        if (l < 0) return place_between(first_added_ - 1 - l, frames);
        return put_all(track_.base(l), track_.frames(l), frames);
    }
    const frame<T>* place_end(frame<T>* frames) override { return place(0, frames); }
    const std::vector<instant>& path() const override { return path_; }

    double final_turn() const override {
        const quaternion q = track_.attitude(track_.nodes());
        return 2 * angle_of_sine(std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z));
    }
    double peak_turn() const override { return 2 * angle_of_sine(track_.greatest_half_sine()); }
    T rate() const override {
        return greatest([&](int l) { return track_.rate(l); });
    }
    T arm_momentum() const override {
        return greatest([&](int l) { return track_.arm_momentum(l); });
    }
    T duration(T fastest) const override {
        const T asked = this->p_.base.momentum.duration;
        return asked > T(0) ? asked : fastest;
    }

    terminal_residual missed(const terminal_constraints& asked) const override {
        return residual_of(asked, end_of(asked));
    }
    terminal_residual at_end(const motion<T>& m, const terminal_constraints& asked, bool roughly) override {
        follow(m, roughly ? end_nodes / 2 : end_nodes, false);
        return missed(asked);
    }
    void poses(const motion<T>& m, int nodes, bool last_only, T* out) override {
        follow(m, nodes, false);
        for (int node = last_only ? nodes : 0; node <= nodes; ++node, out += 7) {
            std::fill(out, out + 3, T(0));
            if (node > 0) {
                T lane[W];
                const vec3<T>& origin = track_.base((node - 1) / W).origin;
                const pack<T>* c[3] = {&origin.x, &origin.y, &origin.z};
                for (int k = 0; k < 3; ++k) {
                    c[k]->store(lane);
                    out[k] = lane[(node - 1) % W];
                }
            }
            const quaternion q = track_.attitude(node);
            const double wxyz[4] = {q.w, q.x, q.y, q.z};
            for (int k = 0; k < 4; ++k) out[3 + k] = static_cast<T>(wxyz[k]);
        }
    }

    const search_hints& hints() const override { return hints_; }
    void add_instants(const std::vector<double>& around) override {
        this->added_.push_back(around);
        fine_nodes_ = std::min(2 * fine_nodes_, this->most_instants);
        this->edge_packs_ = std::min(2 * this->edge_packs_, this->most_instants / W);
    }

  private:
    static constexpr int coarse_nodes = 64, first_fine_nodes = 128;
    static constexpr int end_nodes = sizeof(T) == 4 ? 64 : 256;  // measured: docs/theory.md
    static constexpr int most_added = 8;                         // packs of added instants, the latest

    void follow(const motion<T>& m, int nodes, bool with_frames) {
        const int K = m.interior, n = this->p_.dofs();
        this->configurations += nodes;
        track_.follow(K, std::max(nodes, 16) / W, this->p_.base.momentum, with_frames, [&](int k, int d) {
            return k == 0       ? this->p_.start[d]
                   : k == K + 1 ? this->p_.end(m)[d]
                                : m.points[static_cast<std::size_t>(k - 1) * n + d];
        });
    }
    // More for a long motion: on the whole they are as dense as an edge's instants.
    int fine_nodes(const motion<T>& m) {
        along_.take(m, this->p_.start.data(), this->p_.end(m), this->p_.dofs());
        const T wanted = along_.measure_lengths() * T(instants_per_unit) * T(fine_nodes_) / T(first_fine_nodes);
        int nodes = fine_nodes_;
        while (nodes < this->most_instants && T(nodes) < wanted) nodes *= 2;
        return nodes;
    }
    const frame<T>* put_all(const frame<T>& base, const frame<T>* local, frame<T>* frames) const {
        for (std::size_t j = 0; j < local_.size(); ++j) put(base, local[j], this->p_.scene.shape_columns[j], frames[j]);
        return &base;
    }
    // At a pack of added instants: the joints in the frame of the base, then where the base is between two nodes.
    const frame<T>* place_between(int added, frame<T>* frames) {
        T lane[W];
        for (int i = 0; i < W; ++i) lane[i] = static_cast<T>(this->added_[added][i]);
        for (int d = 0; d < this->p_.dofs(); ++d)
            q_[d] = this->p_.coordinate(*m_, added_values_ + pack_offset<T>(added, m_->interior), d);
        const model<T>& scene = this->p_.scene;
        this->place_joints(q_.data(), local_.data());
        const momentum_at<T> at = momentum_of(scene.robot, scene.masses, q_.data(), local_.data(), rates_.data());
        between_ = track_.base_at(pack<T>::load(lane), at.com, this->p_.base.momentum);
        return put_all(between_, local_.data(), frames);
    }
    motion_end end_of(const terminal_constraints& asked) const {
        const int l = track_.packs() - 1;
        motion_end out;
        if (asked.kind != frame_goal::none) last_lanes(track_.frames(l)[asked.joint], out.joint, out.joint_origin);
        last_lanes(track_.base(l), out.base, out.base_origin);
        out.attitude = track_.attitude(track_.nodes());
        return out;
    }
    template <class Vector> T greatest(Vector&& vector) const {
        pack<T> most(T(0));
        for (int l = 0; l < track_.packs(); ++l) most = max(most, dot(vector(l), vector(l)));
        return std::sqrt(greatest_of(most));
    }

    floating_track<T> track_;
    const motion<T>* m_ = nullptr;
    const T* added_values_ = nullptr;
    bool fine_ = false;
    int fine_nodes_ = first_fine_nodes, first_added_ = 0;
    local_spline<T> along_;
    std::vector<pack<T>> q_;
    std::vector<frame<T>> local_;
    std::vector<spin_and_velocity<T>> rates_;
    frame<T> between_;
    std::vector<instant> path_;
    // A look takes longer than one at the clock; and the trees do not know where the base goes.
    const search_hints hints_{1, 4, false, false};
};

}  // namespace SPACEARM_NAMESPACE
