// A floating base, as the finder of proofs sees it: where it is at any place on the path, and how far it moves on a
// stretch of it.
//
// The attitude is the polynomial that `proof/base_attitude.py` found, and the bounds are those of
// `proof/base_momentum.py`; docs/certificate.md, section 5, has their proofs, and the letters are the same. Nothing
// proven rests on this file: the checker computes all of it anew.
//
// Frames are 3 x 4 matrices, row by row: the axes and the origin. All is plain double, and independent of the
// processor.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace spacearm_proof {

// The base's motion on one stretch, in inertial axes; the fields of `BaseMotionBounds`.
struct BaseBounds {
    double com[3];                  // the system's centre of mass at the midpoint
    std::vector<double> com_lever;  // (j, 3) the lever arm by which a revolute joint moves it
    const double* mass_share;       // (j) the share of the whole mass that a joint moves; the FloatingBase's own
    double com_velocity[3];         // per unit of u
    double omega[3];                // the base's rate of turn at the midpoint, per unit of u
    double rotation;                // theta: the base rotates no further than this from its attitude at the midpoint
    double rotation_second_order;   // E: its rotation is the rate times the change of u, up to this
    double attitude_error;          // by how much the attitude at the midpoint may be wrong
};

// What a FloatingBase is made of; the fields of `FloatingBaseArrays`. All arrays are copied.
struct FloatingBaseInput {
    int joints, bodies, panels, points;
    const int* parent;     // (j) the joint before each one, -1 for the base; always a lower number
    const bool* revolute;  // (j)
    const int* joint_of_body;
    const double *mass, *com, *inertia, *greatest, *spread;  // (b), (b, 3), (b, 3, 3), (b), (b)
    double base_least;                                       // the base's own least moment of inertia
    const double *ends, *start, *coefficients;               // (p, 2), (p, 4), (p, g, 4) of the attitude's panels
    double begin;                                            // where the path begins
    const double *center, *velocity;                         // (3) of the centre of mass at the beginning, per unit u
    const double* angular;                                   // (3) the angular momentum times dt/du
    double attitude_error;
};

namespace floating {

struct Vector {
    double x, y, z;
};
inline Vector vector_at(const double* p) { return {p[0], p[1], p[2]}; }
inline Vector operator+(Vector a, Vector b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vector operator-(Vector a, Vector b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vector operator*(double s, Vector a) { return {s * a.x, s * a.y, s * a.z}; }
inline double dot(Vector a, Vector b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vector cross(Vector a, Vector b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double length(Vector a) { return std::sqrt(dot(a, a)); }
inline void put(Vector a, double* to) {
    to[0] = a.x;
    to[1] = a.y;
    to[2] = a.z;
}

struct Symmetric {
    double xx, xy, xz, yy, yz, zz;
};
inline Symmetric operator+(const Symmetric& a, const Symmetric& b) {
    return {a.xx + b.xx, a.xy + b.xy, a.xz + b.xz, a.yy + b.yy, a.yz + b.yz, a.zz + b.zz};
}
inline Symmetric operator-(const Symmetric& a, const Symmetric& b) {
    return {a.xx - b.xx, a.xy - b.xy, a.xz - b.xz, a.yy - b.yy, a.yz - b.yz, a.zz - b.zz};
}
inline Vector operator*(const Symmetric& a, Vector v) {
    return {a.xx * v.x + a.xy * v.y + a.xz * v.z, a.xy * v.x + a.yy * v.y + a.yz * v.z,
            a.xz * v.x + a.yz * v.y + a.zz * v.z};
}
// m (2 a.b - a b^T - b a^T): with a = b twice the inertia of a point of mass m there.
inline Symmetric inertia_of(double m, Vector a, Vector b) {
    const double d = 2 * dot(a, b);
    return {m * (d - 2 * a.x * b.x), m * (-a.x * b.y - a.y * b.x), m * (-a.x * b.z - a.z * b.x),
            m * (d - 2 * a.y * b.y), m * (-a.y * b.z - a.z * b.y), m * (d - 2 * a.z * b.z)};
}
inline Symmetric inertia_of_point(double m, Vector a) { return inertia_of(m / 2, a, a); }
// The derivative of J for a rotation about z: [z x] J - J [z x].
inline Symmetric commutator(Vector z, const Symmetric& J) {
    const Vector a = cross(z, {J.xx, J.xy, J.xz}), b = cross(z, {J.xy, J.yy, J.yz}), c = cross(z, {J.xz, J.yz, J.zz});
    return {2 * a.x, a.y + b.x, a.z + c.x, 2 * b.y, b.z + c.y, 2 * c.z};
}
inline Symmetric inverse_of(const Symmetric& a) {
    const double x = a.yy * a.zz - a.yz * a.yz, y = a.xz * a.yz - a.xy * a.zz, z = a.xy * a.yz - a.xz * a.yy;
    const double s = 1 / (a.xx * x + a.xy * y + a.xz * z);
    return {s * x,
            s * y,
            s * z,
            s * (a.xx * a.zz - a.xz * a.xz),
            s * (a.xy * a.xz - a.xx * a.yz),
            s * (a.xx * a.yy - a.xy * a.xy)};
}

// The least eigenvalue, by Jacobi's rotations.
inline double least_eigenvalue(const Symmetric& of) {
    double a[3][3] = {{of.xx, of.xy, of.xz}, {of.xy, of.yy, of.yz}, {of.xz, of.yz, of.zz}};
    constexpr int sweeps = 12;
    for (int sweep = 0; sweep < sweeps; ++sweep) {
        const double off = a[0][1] * a[0][1] + a[0][2] * a[0][2] + a[1][2] * a[1][2];
        const double on = a[0][0] * a[0][0] + a[1][1] * a[1][1] + a[2][2] * a[2][2];
        if (!(off > 1e-34 * on)) break;
        for (int p = 0; p < 2; ++p) {
            for (int q = p + 1; q < 3; ++q) {
                if (a[p][q] == 0) continue;
                const double between = (a[q][q] - a[p][p]) / (2 * a[p][q]);
                const double t = std::copysign(1.0, between) / (std::abs(between) + std::sqrt(between * between + 1));
                const double c = 1 / std::sqrt(t * t + 1), s = t * c;
                const int r = 3 - p - q;
                a[p][p] -= t * a[p][q];
                a[q][q] += t * a[p][q];
                a[p][q] = a[q][p] = 0;
                const double rp = a[r][p], rq = a[r][q];
                a[r][p] = a[p][r] = c * rp - s * rq;
                a[r][q] = a[q][r] = s * rp + c * rq;
            }
        }
    }
    return std::min({a[0][0], a[1][1], a[2][2]});
}

inline Vector rotated(const double* T, Vector v) {
    return {T[0] * v.x + T[1] * v.y + T[2] * v.z, T[4] * v.x + T[5] * v.y + T[6] * v.z,
            T[8] * v.x + T[9] * v.y + T[10] * v.z};
}
inline Vector origin_of(const double* T) { return {T[3], T[7], T[11]}; }
// R I R^T of a frame.
inline Symmetric rotated(const double* T, const Symmetric& I) {
    const Vector row[3] = {{T[0], T[1], T[2]}, {T[4], T[5], T[6]}, {T[8], T[9], T[10]}};
    const Vector a = I * row[0], b = I * row[1], c = I * row[2];
    return {dot(row[0], a), dot(row[1], a), dot(row[2], a), dot(row[1], b), dot(row[2], b), dot(row[2], c)};
}

}  // namespace floating

// Not to be used by two threads at once: its scratch is its own.
class FloatingBase {
  public:
    explicit FloatingBase(const FloatingBaseInput& from)
        : joints_(from.joints), points_(from.points), revolute_(from.revolute, from.revolute + from.joints),
          parent_(from.parent, from.parent + from.joints), base_least_(from.base_least),
          ends_(from.ends, from.ends + 2 * from.panels), start_(from.start, from.start + 4 * from.panels),
          coefficients_(from.coefficients, from.coefficients + static_cast<std::size_t>(4) * from.panels * from.points),
          begin_(from.begin), center_(floating::vector_at(from.center)), velocity_(floating::vector_at(from.velocity)),
          angular_(floating::vector_at(from.angular)), attitude_error_(from.attitude_error), share_(joints_),
          greatest_(joints_), spread_(joints_), related_(static_cast<std::size_t>(joints_) * joints_), joint_(joints_),
          legendre_(points_ + 1), slope_(related_.size()), related_G_(related_.size()),
          related_greatest_(related_.size()), related_spread_(related_.size()) {
        take_masses(from);
    }

    int joints() const { return joints_; }

    // T_w_base (3 x 4) at u, for T_base_joints (j, 3 x 4) there.
    void place(double u, const double* T_base_joints, double* T_w_base) const {
        double q[4];
        attitude_at(u, q);
        const double w = q[0], x = q[1], y = q[2], z = q[3];
        const double R[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
                             2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                             2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
        floating::Vector moment = base_.moment;
        for (int k = 0; k < joints_; ++k) {
            const double* T = T_base_joints + 12 * k;
            moment =
                moment + floating::rotated(T, joint_masses_[k].moment) + joint_masses_[k].mass * floating::origin_of(T);
        }
        const floating::Vector r = (1 / total_) * moment, at = center_ + (u - begin_) * velocity_;
        for (int i = 0; i < 3; ++i) {
            std::copy(R + 3 * i, R + 3 * i + 3, T_w_base + 4 * i);
            T_w_base[4 * i + 3] = (i == 0   ? at.x
                                   : i == 1 ? at.y
                                            : at.z)
                                  - floating::dot({R[3 * i], R[3 * i + 1], R[3 * i + 2]}, r);
        }
    }

    // Bound the base's motion on a stretch.
    // T_w_joints (j, 3 x 4), T_w_base (3 x 4): at the midpoint. rate, deviation, step (j): w_k per unit of u, e_k and
    // delta_k of the joints' values. half: half the stretch's length in u.
    BaseBounds bounds(const double* T_w_joints, const double* T_w_base, const double* rate, const double* deviation,
                      const double* step, double half) const {
        BaseBounds out;
        bounds(T_w_joints, T_w_base, rate, deviation, step, half, out);
        return out;
    }

    // The same into bounds that were made before: nothing is allocated.
    void bounds(const double* T_w_joints, const double* T_w_base, const double* rate, const double* deviation,
                const double* step, double half, BaseBounds& out) const {
        using namespace floating;
        place_masses(T_w_joints, T_w_base, out);
        const double spin = length(angular_);
        Vector omega = inverse_ * angular_;
        for (int k = 0; k < joints_; ++k) {
            Joint& own = joint_[k];
            const Vector spun = revolute_[k] ? own.inertia * own.z : Vector{0, 0, 0};
            own.momentum = spun + own.mass * cross(own.arm, own.push);
            own.W = -1.0 * (inverse_ * own.momentum);
            own.W_size = length(own.W);
            omega = omega + rate[k] * own.W;
            own.turned = revolute_[k] ? commutator(own.z, own.inertia) : Symmetric{0, 0, 0, 0, 0, 0};
            own.inertia_change = own.turned + inertia_of(own.mass, own.arm, own.push);
        }
        Slopes at_midpoint = slopes(rate, step, half);
        bound_rates(step);
        const double least_inverse = 1 / least_on_stretch_;
        double second =
            length(at_midpoint.curved) * half * half / 2 + at_midpoint.off_line + third_order(step, least_inverse);
        second = std::min(second, second_order(step));
        const double own = spin * least_inverse * half;  // the rotation by the angular momentum, at most
        double crude = own, moved = 0, deviating = 0;
        for (int k = 0; k < joints_; ++k) {
            crude += joint_[k].rate * step[k];
            moved += joint_[k].A * step[k];
            deviating += joint_[k].W_size * deviation[k];
        }
        moved = crude + least_inverse * moved + attitude_error_;
        out.rotation_second_order = (deviating + second + own * moved) * outward + crude * rounding;
        out.rotation = std::min(crude, length(omega) * half + out.rotation_second_order) * outward;
        put(omega, out.omega);
        put(velocity_, out.com_velocity);
        out.mass_share = share_.data();
        out.attitude_error = attitude_error_;
    }

  private:
    static constexpr double outward = 1 + 1e-9;  // times a bound, for its rounding
    static constexpr double rounding =
        1e-11;  // times the crude bound of the rotation: the absolute part of its rounding
    static constexpr double axis_rounding = 1e-14;  // times a squared distance, which is added to that from an axis
    static constexpr double shortest = 1e-300;      // in place of a length of 0 in a quotient

    struct Body {
        int joint;
        double mass;
        floating::Vector com;
        floating::Symmetric inertia;
    };
    struct Moment {  // of the bodies that a joint carries itself
        double mass = 0;
        floating::Vector moment{0, 0, 0};
    };
    struct Joint {
        double mass;  // that it moves
        floating::Vector z, origin, arm, push, momentum, W, sum;
        floating::Symmetric inertia, turned, inertia_change;
        double W_size, gyration, G, A, rate;
    };
    struct Slopes {
        floating::Vector curved;  // the sum of D_ki w_k w_i
        double off_line;          // that of |D_ki| (delta_k delta_i - |w_k w_i| h^2)
    };

    void take_masses(const FloatingBaseInput& from) {
        joint_masses_.resize(joints_);
        for (int b = 0; b < from.bodies; ++b) {
            const double* I = from.inertia + 9 * b;
            const Body body{from.joint_of_body[b],
                            from.mass[b],
                            floating::vector_at(from.com + 3 * b),
                            {I[0], I[1], I[2], I[4], I[5], I[8]}};
            bodies_.push_back(body);
            Moment& of = body.joint < 0 ? base_ : joint_masses_[body.joint];
            of.mass += body.mass;
            of.moment = of.moment + body.mass * body.com;
            total_ += body.mass;
            for (int on = body.joint; on >= 0; on = parent_[on]) {
                joint_[on].mass += body.mass;
                greatest_[on] += from.greatest[b];
                if (revolute_[on]) spread_[on] += from.spread[b];
                beyond_.push_back({on, b});
            }
        }
        com_.resize(bodies_.size());
        for (int k = 0; k < joints_; ++k) {
            share_[k] = joint_[k].mass / total_;
            for (int on = k; on >= 0; on = parent_[on]) related_[at(k, on)] = related_[at(on, k)] = true;
        }
    }

    std::size_t at(int k, int i) const { return static_cast<std::size_t>(k) * joints_ + i; }

    // ---- the attitude
    // ------------------------------------------------------------------------------------------------

    // The unit quaternion at u: start * (1 + the sum of coefficients times integrals of Legendre's polynomials).
    void attitude_at(double u, double* q) const {
        int panel = 0, beyond = static_cast<int>(ends_.size() / 2);  // the last panel that begins at or before u
        while (beyond - panel > 1) {
            const int middle = (panel + beyond) / 2;
            (ends_[2 * middle] <= u ? panel : beyond) = middle;
        }
        const double low = ends_[2 * panel], high = ends_[2 * panel + 1];
        const double xi = std::clamp((2 * u - low - high) / std::max(high - low, shortest), -1.0, 1.0);
        double* P = legendre_.data();
        P[0] = 1;
        P[1] = xi;
        for (int i = 2; i <= points_; ++i) P[i] = (P[i - 1] * xi * (2 * i - 1) - P[i - 2] * (i - 1)) / i;
        double turned[4] = {1, 0, 0, 0};
        const double* c = coefficients_.data() + static_cast<std::size_t>(4) * panel * points_;
        for (int k = 0; k < points_; ++k, c += 4) {
            const double integral = k == 0 ? xi + 1 : (P[k + 1] - P[k - 1]) / (2 * k + 1);
            for (int i = 0; i < 4; ++i) turned[i] += integral * c[i];
        }
        const double* s = start_.data() + 4 * panel;
        const double a = s[0], b = s[1], d = s[2], e = s[3], w = turned[0], x = turned[1], y = turned[2], z = turned[3];
        q[0] = a * w - b * x - d * y - e * z;
        q[1] = a * x + b * w + d * z - e * y;
        q[2] = a * y - b * z + d * w + e * x;
        q[3] = a * z + b * y - d * x + e * w;
        const double size = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
        for (int i = 0; i < 4; ++i) q[i] /= size;
    }

    // ---- the masses at the midpoint; places are relative to the centre of mass
    // ---------------------------------------

    void place_masses(const double* T_w_joints, const double* T_w_base, BaseBounds& out) const {
        using namespace floating;
        Vector center{0, 0, 0};
        for (std::size_t b = 0; b < bodies_.size(); ++b) {
            const double* T = bodies_[b].joint < 0 ? T_w_base : T_w_joints + 12 * bodies_[b].joint;
            com_[b] = rotated(T, bodies_[b].com) + origin_of(T);
            center = center + bodies_[b].mass * com_[b];
        }
        center = (1 / total_) * center;
        put(center, out.com);
        for (Joint& joint : joint_) {
            joint.sum = {0, 0, 0};
            joint.inertia = {0, 0, 0, 0, 0, 0};
            joint.gyration = 0;
        }
        Symmetric H{0, 0, 0, 0, 0, 0};
        double size = 0;
        for (std::size_t b = 0; b < bodies_.size(); ++b) {
            const Body& body = bodies_[b];
            com_[b] = com_[b] - center;
            const double* T = body.joint < 0 ? T_w_base : T_w_joints + 12 * body.joint;
            const Symmetric whole = rotated(T, body.inertia) + inertia_of_point(body.mass, com_[b]);
            if (body.joint < 0) {
                H = H + whole;
            } else {
                joint_[body.joint].inertia = joint_[body.joint].inertia + whole;
                joint_[body.joint].sum = joint_[body.joint].sum + body.mass * com_[b];
            }
            size += body.mass * dot(com_[b], com_[b]);
        }
        out.com_lever.resize(static_cast<std::size_t>(3) * joints_);
        for (int k = joints_ - 1; k >= 0; --k) {
            Joint& own = joint_[k];
            if (parent_[k] >= 0) {
                joint_[parent_[k]].inertia = joint_[parent_[k]].inertia + own.inertia;
                joint_[parent_[k]].sum = joint_[parent_[k]].sum + own.sum;
            } else {
                H = H + own.inertia;
            }
            const double* T = T_w_joints + 12 * k;
            own.z = {T[2], T[6], T[10]};
            own.origin = origin_of(T) - center;
            own.arm = own.mass > 0 ? (1 / own.mass) * own.sum : own.origin;
            const Vector lever = own.arm - own.origin;
            own.push = revolute_[k] ? cross(own.z, lever) : own.z;
            put(share_[k] * lever, &out.com_lever[3 * k]);
        }
        for (int k = 0; k < joints_; ++k)
            joint_[k].inertia = joint_[k].inertia - inertia_of_point(joint_[k].mass, joint_[k].arm);
        for (const auto& [k, b] : beyond_) {
            Joint& own = joint_[k];
            const Vector away = com_[b] - own.origin;
            const double height = dot(away, own.z), squared = dot(away, away);
            own.gyration += bodies_[b].mass
                            * (revolute_[k] ? std::max(squared - height * height, 0.0) + axis_rounding * squared : 1.0);
        }
        for (Joint& joint : joint_) joint.gyration = std::sqrt(joint.gyration) * outward;
        inverse_ = inverse_of(H);
        least_ = least_eigenvalue(H);
        size_ = std::sqrt(size) * outward;
    }

    // ---- the rates W and their derivatives D
    // -------------------------------------------------------------------------

    Slopes slopes(const double* rate, const double* step, double half) const {
        using namespace floating;
        Vector curved{0, 0, 0};
        double off_line = 0;
        for (int k = 0; k < joints_; ++k) {
            for (int i = 0; i < joints_; ++i) {
                const Vector D = -1.0 * (inverse_ * change(k, i));
                curved = curved + rate[k] * rate[i] * D;
                const double on_line = std::abs(rate[k]) * half * (std::abs(rate[i]) * half);
                off_line += length(D) * (step[k] * step[i] - on_line);
            }
        }
        return {curved, off_line};
    }

    // The derivative of h_k with respect to joint i's value, and of H with respect to it times W_k.
    floating::Vector change(int k, int i) const {
        using namespace floating;
        const Joint &of = joint_[k], &by = joint_[i];
        Vector out = by.inertia_change * of.W - of.mass * cross(share_[i] * by.push, of.push);
        if (!related_[at(k, i)]) return out;
        if (i <= k) {  // joint i carries what joint k moves: it moves its centre by z x (arm - origin)
            if (revolute_[i]) out = out + cross(by.z, of.momentum) - of.mass * cross(cross(by.z, by.origin), of.push);
            else out = out + of.mass * cross(by.z, of.push);
            return out;
        }
        // The momentum that joint k, before i, gives to the bodies that joint i moves.
        if (!revolute_[k]) return out + by.mass * cross(by.push, of.z);
        const Vector lever = cross(of.z, by.arm - of.origin);
        return out + by.turned * of.z + by.mass * (cross(by.push, lever) + cross(by.arm, cross(of.z, by.push)));
    }

    // ---- bounds on the whole stretch, by the table at the end of section 5 of docs/certificate.md
    // ----------------------

    // The outermost of two or three joints on one chain has the greatest number.
    void bound_rates(const double* step) const {
        double size = size_;
        for (int i = 0; i < joints_; ++i) {
            double G = joint_[i].gyration;
            for (int l = i + 1; l < joints_; ++l) {
                if (related_[at(l, i)]) G += joint_[l].gyration * step[l];
            }
            joint_[i].G = G;
            size += joint_[i].gyration * step[i];
        }
        size_on_stretch_ = size;
        double least = least_;
        for (int i = 0; i < joints_; ++i) {
            joint_[i].A = spread_[i] + 2 * size * joint_[i].G;
            least -= joint_[i].A * step[i];
        }
        least_on_stretch_ = std::max(base_least_, least);
        const double y = 1 / least_on_stretch_;
        for (int k = 0; k < joints_; ++k) {
            Joint& own = joint_[k];
            const double crude = y * (greatest_[k] + size * own.G);
            double rate = own.W_size;
            for (int i = 0; i < joints_; ++i) {
                const bool related = related_[at(k, i)];
                const int outer = std::max(k, i);
                related_G_[at(k, i)] = related ? joint_[outer].G : 0.0;
                related_greatest_[at(k, i)] = related ? greatest_[outer] : 0.0;
                related_spread_[at(k, i)] = related ? spread_[outer] : 0.0;
                slope_[at(k, i)] = related_greatest_[at(k, i)] + own.G * joint_[i].G + size * related_G_[at(k, i)];
                rate += y * (slope_[at(k, i)] + joint_[i].A * crude) * step[i];
            }
            own.rate = std::min(crude, rate);
            for (int i = 0; i < joints_; ++i) slope_[at(k, i)] = y * (slope_[at(k, i)] + joint_[i].A * own.rate);
        }
    }

    double second_order(const double* step) const {
        double out = 0;
        for (int k = 0; k < joints_; ++k) {
            for (int i = 0; i < k; ++i) out += std::max(slope_[at(k, i)], slope_[at(i, k)]) * step[k] * step[i];
            out += slope_[at(k, k)] * step[k] * step[k] / 2;
        }
        return out;
    }

    // The sum of |d2W_k / dv_i dv_l| delta_k delta_i delta_l / 6, with the greatest of the permutations of k, i, l.
    double third_order(const double* step, double y) const {
        double out = 0;
        for (int k = 0; k < joints_; ++k) {
            if (step[k] == 0) continue;
            for (int i = 0; i <= k; ++i) {
                if (step[i] == 0) continue;
                double row = 0;
                for (int l = 0; l <= i; ++l) row += curve(k, i, l) * step[l] * weight(k, i, l);
                out += row * step[i] * step[k];
            }
        }
        return y * out;
    }
    static double weight(int k, int i, int l) {  // how many permutations there are, over 6
        return k == i ? (i == l ? 1.0 / 6 : 0.5) : (i == l ? 0.5 : 1.0);
    }

    // Of joints k >= i >= l. Without 1 / least.
    double curve(int k, int i, int l) const {
        const double G_k = joint_[k].G, G_i = joint_[i].G, G_l = joint_[l].G;
        const double A_k = joint_[k].A, A_i = joint_[i].A, A_l = joint_[l].A;
        const double G_ki = related_G_[at(k, i)], G_kl = related_G_[at(k, l)], G_il = related_G_[at(i, l)];
        const bool chain = related_[at(k, i)] && related_[at(k, l)] && related_[at(i, l)];
        const double same =
            (chain ? 2 * greatest_[k] + size_on_stretch_ * G_k : 0.0) + G_il * G_k + G_kl * G_i + G_ki * G_l;
        const double size = 2 * size_on_stretch_;
        const double A_ki = 2 * related_spread_[at(k, i)] + 2 * G_k * G_i + size * G_ki;
        const double A_kl = 2 * related_spread_[at(k, l)] + 2 * G_k * G_l + size * G_kl;
        const double A_il = 2 * related_spread_[at(i, l)] + 2 * G_i * G_l + size * G_il;
        const double of_k = A_il * joint_[k].rate + A_i * slope_[at(k, l)] + A_l * slope_[at(k, i)];
        const double of_i = A_kl * joint_[i].rate + A_k * slope_[at(i, l)] + A_l * slope_[at(i, k)];
        const double of_l = A_ki * joint_[l].rate + A_k * slope_[at(l, i)] + A_i * slope_[at(l, k)];
        return same + std::max({of_k, of_i, of_l});
    }

    int joints_, points_;
    std::vector<char> revolute_;
    std::vector<int> parent_;
    double base_least_, total_ = 0;
    std::vector<double> ends_, start_, coefficients_;
    double begin_;
    floating::Vector center_, velocity_, angular_;
    double attitude_error_;
    std::vector<double> share_, greatest_, spread_;
    std::vector<char> related_;  // (j, j) whether two joints are on one chain
    std::vector<Body> bodies_;
    Moment base_;
    std::vector<Moment> joint_masses_;
    std::vector<std::pair<int, int>> beyond_;  // joints, and bodies that they move
    // Scratch.
    mutable std::vector<Joint> joint_;
    mutable std::vector<floating::Vector> com_;
    mutable std::vector<double> legendre_, slope_, related_G_, related_greatest_, related_spread_;
    mutable floating::Symmetric inverse_;
    mutable double least_, size_, least_on_stretch_, size_on_stretch_;
};

}  // namespace spacearm_proof
