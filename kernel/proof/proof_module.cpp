// The Python module of the finder of proofs: `spacearm._kernel._proof`, one build for all processors.
#include "proof/finder.hpp"

#include "proof/bind_floating_base.hpp"
#include "proof/bind_measure.hpp"
#include "python/arrays.hpp"
#include "python/threads.hpp"

#include <optional>

namespace spacearm_proof {
namespace {

namespace nb = nanobind;
using namespace nb::literals;
using SPACEARM_NAMESPACE::array_of;
using SPACEARM_NAMESPACE::require;
using SPACEARM_NAMESPACE::row_of;
using SPACEARM_NAMESPACE::signal_listener;

template <class T, int... Shape> using given = nb::ndarray<const T, nb::shape<Shape...>, nb::c_contig, nb::device::cpu>;
using numbers = given<double, -1>;
using indices = given<std::int64_t, -1>;
using truths = given<bool, -1>;
using rows = given<double, -1, -1>;
using points = given<double, -1, 3>;

std::vector<int> ints_of(const indices& from) { return {from.data(), from.data() + from.shape(0)}; }
std::vector<char> chars_of(const truths& from) { return {from.data(), from.data() + from.shape(0)}; }
void require_each(std::size_t count, std::initializer_list<std::size_t> lengths) {
    for (const std::size_t length : lengths) require(length == count, "arrays differ in their length");
}
void require_below(const std::vector<int>& numbers, int least, std::size_t beyond, const char* what) {
    for (const int number : numbers) require(number >= least && number < static_cast<int>(beyond), what);
}

Joints joints_of(const indices& parent, const indices& dof, const truths& revolute, const numbers& multiplier,
                 const numbers& offset, const given<double, -1, 4, 4>& placement, int dofs) {
    const std::size_t count = parent.shape(0);
    require_each(count, {dof.shape(0), revolute.shape(0), multiplier.shape(0), offset.shape(0), placement.shape(0)});
    Joints out;
    out.count = static_cast<int>(count);
    out.dofs = dofs;
    out.parent = ints_of(parent);
    out.dof = ints_of(dof);
    out.revolute = chars_of(revolute);
    out.multiplier.assign(multiplier.data(), multiplier.data() + count);
    out.offset.assign(offset.data(), offset.data() + count);
    for (std::size_t k = 0; k < count; ++k) {
        require(out.parent[k] >= -1 && out.parent[k] < static_cast<int>(k), "a joint comes before its parent");
        Frame frame;
        std::copy(placement.data() + 16 * k, placement.data() + 16 * k + 12, frame.T);
        out.placement.push_back(frame);
    }
    require_below(out.dof, 0, dofs, "a joint has no degree of freedom");
    return out;
}

Bodies bodies_of(const indices& frame, const indices& first_point, const indices& count, const points& vertices,
                 const numbers& disc, const points& axis, const numbers& radius, const points& center,
                 const numbers& reach, const truths& half_space, const indices& first_member, const indices& members,
                 const indices& owner, std::size_t frames) {
    const std::size_t size = frame.shape(0);
    require_each(size,
                 {first_point.shape(0), count.shape(0), disc.shape(0), axis.shape(0), radius.shape(0), center.shape(0),
                  reach.shape(0), half_space.shape(0), first_member.shape(0), members.shape(0), owner.shape(0)});
    Bodies out;
    out.vertices.assign(vertices.data(), vertices.data() + vertices.size());
    for (std::size_t i = 0; i < size; ++i) {
        Body body;
        body.frame = static_cast<int>(frame(i));
        body.first_point = static_cast<int>(first_point(i));
        body.points = static_cast<int>(count(i));
        body.first_member = static_cast<int>(first_member(i));
        body.members = static_cast<int>(members(i));
        body.owner = static_cast<int>(owner(i));
        body.half_space = half_space(i);
        body.disc = disc(i);
        body.radius = radius(i);
        body.reach = reach(i);
        body.axis = vec3(&axis(i, 0));
        body.center = vec3(&center(i, 0));
        require(frame(i) >= 0 && frame(i) < std::int64_t(frames), "a body has no frame");
        require(count(i) > 0 && first_point(i) >= 0 && first_point(i) + count(i) <= std::int64_t(vertices.shape(0)),
                "a body has no points");
        require(members(i) >= 0
                    && (members(i) == 0 || (first_member(i) >= 0 && first_member(i) + members(i) <= std::int64_t(i))),
                "a bundle comes before its members");
        out.list.push_back(body);
    }
    return out;
}

RelativeMotion relative_motion(const Joints& joints, int moved, int seen_from, bool free, const double* sign,
                               const double* order) {
    RelativeMotion out{moved, seen_from, 0, free, {}, {}, {}};
    for (int k = 0; k < joints.count; ++k) {
        if (!free && sign[k] == 0) continue;
        out.joints.push_back(k);
        out.sign.push_back(sign[k]);
    }
    for (const int k : out.joints)
        for (const int i : out.joints) out.order.push_back(order[k * joints.count + i]);
    return out;
}

Pairs pairs_of(const Joints& joints, const indices& first, const indices& other,
               const given<std::int64_t, -1, -1>& motion_of, const rows& sign, const given<double, -1, -1, -1>& order,
               const truths& free, const rows& whole_order) {
    const std::size_t frames = motion_of.shape(0), count = joints.count, motions = sign.shape(0);
    require(frames == count + first_joint && motion_of.shape(1) == frames, "the motions do not fit the joints");
    require_each(count, {sign.shape(1), order.shape(1), order.shape(2), whole_order.shape(0), whole_order.shape(1)});
    require_each(motions, {order.shape(0), free.shape(0)});
    require_each(first.shape(0), {other.shape(0)});
    Pairs out;
    out.first = ints_of(first);
    out.other = ints_of(other);
    out.motion_of.assign(motion_of.data(), motion_of.data() + frames * frames);
    out.frames = static_cast<int>(frames);
    require_below(out.motion_of, -1, motions, "there is no such motion");
    out.motions.resize(motions);
    for (int at = 0; at < static_cast<int>(frames * frames); ++at) {
        const int m = out.motion_of[at];
        if (m < 0) continue;
        const double* c = free(m) ? whole_order.data() : order.data() + m * count * count;
        out.motions[m] = relative_motion(joints, at / out.frames, at % out.frames, free(m), sign.data() + m * count, c);
    }
    return out;
}

// Every pair has a motion, and its first body is the robot's; so have the members of bundles, which are on its frame.
void require_pairs(const Tables& tables) {
    const Bodies& bodies = tables.bodies;
    const Pairs& pairs = tables.pairs;
    require_below(pairs.first, 0, bodies.count(), "a pair has no body");
    require_below(pairs.other, 0, bodies.count(), "a pair has no body");
    for (const Body& body : bodies.list)
        for (int i = body.first_member; i < body.first_member + body.members; ++i)
            require(bodies[i].frame == body.frame, "a bundle's member is elsewhere");
    for (std::size_t i = 0; i < pairs.first.size(); ++i) {
        const Body &a = bodies[pairs.first[i]], &b = bodies[pairs.other[i]];
        require(a.frame != world && !a.half_space && pairs.motion(a.frame, b.frame) >= 0, "a pair does not move");
    }
}

// The arrays of a path, kept while it is in use.
struct PathArrays {
    given<double, -1, 2> ends;
    rows least_rate, greatest_rate, second;
    numbers size;
    double rounding;
    numbers breaks;
    given<double, -1, -1, -1> coefficients;

    PathInput input() const {
        const std::size_t pieces = ends.shape(0), dofs = size.shape(0), own = coefficients.shape(0);
        require(pieces > 0 && own > 0 && dofs > 0 && coefficients.shape(1) > 0, "a path without pieces");
        require_each(pieces, {least_rate.shape(0), greatest_rate.shape(0), second.shape(0)});
        require_each(dofs, {least_rate.shape(1), greatest_rate.shape(1), second.shape(1), coefficients.shape(2)});
        require_each(own + 1, {breaks.shape(0)});
        return {static_cast<int>(pieces),
                static_cast<int>(dofs),
                ends.data(),
                least_rate.data(),
                greatest_rate.data(),
                second.data(),
                size.data(),
                rounding,
                static_cast<int>(own),
                static_cast<int>(coefficients.shape(1)) - 1,
                breaks.data(),
                coefficients.data()};
    }
};

struct HeldArrays {
    rows required;
    given<std::int64_t, -1, -1> phase, near;
    given<double, -1, 3> held;
    numbers until, since, known_excess, share;

    Held input(const Bodies& bodies) const {
        const std::size_t links = required.shape(0), count = bodies.count(), pairs = held.shape(0);
        const std::size_t phases = known_excess.shape(0);
        require_each(links, {phase.shape(0), near.shape(0)});
        require_each(count, {required.shape(1), phase.shape(1), near.shape(1)});
        require_each(pairs, {until.shape(0), since.shape(0)});
        require(phases >= 1 + 3 * pairs && share.shape(0) == phases, "the phases do not fit the pairs");
        for (std::size_t i = 0; i < links * count; ++i) {
            require(phase.data()[i] >= 0 && phase.data()[i] < std::int64_t(phases), "there is no such phase");
            require(near.data()[i] >= 0 && near.data()[i] <= std::int64_t(pairs), "there is no such pair");
        }
        for (const Body& body : bodies.list)
            require(body.frame == world || (body.owner >= 0 && body.owner < int(links)), "a body has no link");
        return {required.data(), phase.data(),        near.data(),  held.data(),    until.data(),
                since.data(),    known_excess.data(), share.data(), bodies.count(), static_cast<int>(phases)};
    }
};

Found find_proof(const Tables& tables, const PathArrays& path_arrays, const HeldArrays& held_arrays,
                 const numbers& tracking, const given<double, 4, 4>& start, const FloatingBase* floating,
                 double resolution) {
    Path path(path_arrays.input());
    require(path.dofs() == tables.joints.dofs, "the path does not fit the joints");
    require_each(path.dofs(), {tracking.shape(0)});
    require(floating == nullptr || floating->joints() == tables.joints.count, "the base does not fit the joints");
    for (const RelativeMotion& motion : tables.pairs.motions)
        require(!motion.free || floating != nullptr, "a free motion needs a base that floats");
    const Held held = held_arrays.input(tables.bodies);
    Frame base;
    std::copy(start.data(), start.data() + 12, base.T);
    std::optional<FloatingBase> own;  // its scratch is not for two threads
    if (floating) own.emplace(*floating);
    nb::gil_scoped_release free;
    signal_listener signals;
    MotionBounds motion(tables, path, tracking.data(), base, own ? &*own : nullptr);
    return Finder(tables, path, motion, held, resolution, [&] { signals.ask(); }).find();
}

void bind_tables(nb::module_& m) {
    nb::class_<Tables>(m, "Tables", "Joints, bodies and pairs, which stay the same for a robot and a scene.")
        .def(
            "__init__",
            [](Tables* self, const indices& parent, const indices& dof, const truths& revolute,
               const numbers& multiplier, const numbers& offset, const given<double, -1, 4, 4>& placement, int dofs,
               const indices& frame, const indices& first_point, const indices& count, const points& vertices,
               const numbers& disc, const points& axis, const numbers& radius, const points& center,
               const numbers& reach, const truths& half_space, const indices& first_member, const indices& members,
               const indices& owner, const indices& first, const indices& other,
               const given<std::int64_t, -1, -1>& motion_of, const rows& sign, const given<double, -1, -1, -1>& order,
               const truths& free, const rows& whole_order) {
                Tables out;
                out.joints = joints_of(parent, dof, revolute, multiplier, offset, placement, dofs);
                out.bodies = bodies_of(frame, first_point, count, vertices, disc, axis, radius, center, reach,
                                       half_space, first_member, members, owner, out.joints.count + first_joint);
                out.pairs = pairs_of(out.joints, first, other, motion_of, sign, order, free, whole_order);
                require_pairs(out);
                out.index();
                new (self) Tables(std::move(out));
            },
            nb::kw_only(), "parent"_a, "dof"_a, "revolute"_a, "multiplier"_a, "offset"_a, "placement"_a, "dofs"_a,
            "frame"_a, "first_point"_a, "points"_a, "vertices"_a, "disc"_a, "axis"_a, "radius"_a, "center"_a, "reach"_a,
            "half_space"_a, "first_member"_a, "members"_a, "owner"_a, "first"_a, "other"_a, "motion_of"_a, "sign"_a,
            "order"_a, "free"_a, "whole_order"_a);
}

void bind_inputs(nb::module_& m) {
    nb::class_<PathArrays>(m, "Path", "A curve and bounds of its pieces; see `PathIntervals`.")
        .def(
            "__init__",
            [](PathArrays* self, given<double, -1, 2> ends, rows least_rate, rows greatest_rate, rows second,
               numbers size, double rounding, numbers breaks, given<double, -1, -1, -1> coefficients) {
                new (self) PathArrays{ends, least_rate, greatest_rate, second, size, rounding, breaks, coefficients};
            },
            nb::kw_only(), "ends"_a, "least_rate"_a, "greatest_rate"_a, "second"_a, "size"_a, "rounding"_a, "breaks"_a,
            "coefficients"_a);
    nb::class_<HeldArrays>(m, "Held", "What pairs are held to; see `HeldClearances`.")
        .def(
            "__init__",
            [](HeldArrays* self, rows required, given<std::int64_t, -1, -1> phase, given<std::int64_t, -1, -1> near,
               given<double, -1, 3> held, numbers until, numbers since, numbers known_excess, numbers share) {
                new (self) HeldArrays{required, phase, near, held, until, since, known_excess, share};
            },
            nb::kw_only(), "required"_a, "phase"_a, "near"_a, "held"_a, "until"_a, "since"_a, "known_excess"_a,
            "share"_a);
}

void bind_found(nb::module_& m) {
    nb::enum_<Status>(m, "Status", "What the finder thinks.")
        .value("HOLDS", Status::holds)
        .value("FAILS", Status::fails)
        .value("UNDECIDED", Status::undecided);
    nb::class_<Suspect>(m, "Suspect", "A pair of shapes that is close; `first` is -1 where none was measured.")
        .def_ro("first", &Suspect::first)
        .def_ro("other", &Suspect::other)
        .def_ro("u", &Suspect::u)
        .def_ro("clearance", &Suspect::clearance);
    nb::class_<Found>(m, "Found", "What a search found.")
        .def_ro("status", &Found::status)
        .def_prop_ro(
            "steps", [](const Found& found) { return row_of(found.steps); }, nb::rv_policy::move)
        .def_prop_ro(
            "directions",
            [](const Found& found) {
                return array_of<double, 2>(std::vector(found.directions), {found.directions.size() / 3, 3});
            },
            nb::rv_policy::move)
        .def_ro("closest", &Found::closest)
        .def_ro("worst", &Found::worst)
        .def_ro("nodes", &Found::nodes)
        .def_ro("stretches", &Found::stretches);
}

void bind_clearances(nb::module_& m) {
    bind_measure(m).def(
        "__init__",
        [](Clearances* self, const Tables& tables, const PathArrays& path, const numbers& tracking,
           const given<double, 4, 4>& start, const FloatingBase* floating) {
            const PathInput input = path.input();
            require(input.dofs == tables.joints.dofs, "the path does not fit the joints");
            require_each(input.dofs, {tracking.shape(0)});
            require(floating == nullptr || floating->joints() == tables.joints.count,
                    "the base does not fit the joints");
            Frame base;
            std::copy(start.data(), start.data() + 12, base.T);
            new (self) Clearances(tables, input, tracking.data(), base, floating);
        },
        nb::kw_only(), "tables"_a, "path"_a, "tracking"_a, "start"_a, "floating"_a.none(), nb::keep_alive<1, 2>(),
        nb::keep_alive<1, 3>(), nb::keep_alive<1, 6>());
}

}  // namespace

NB_MODULE(_proof, m) {
    m.doc() = "The finder of proofs.";
    bind_tables(m);
    bind_inputs(m);
    bind_found(m);
    bind_floating_base(m);
    bind_clearances(m);
    m.def("find_proof", &find_proof, nb::kw_only(), "tables"_a, "path"_a, "held"_a, "tracking"_a, "start"_a,
          "floating"_a.none(), "resolution"_a, "Search a proof that all pairs keep more than they are held to.");
}

}  // namespace spacearm_proof
