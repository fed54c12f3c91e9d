// About how deep two bodies overlap whose cores meet. It ranks failures only: nothing else depends on it.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "proof/bodies.hpp"
#include "proof/nearest_points.hpp"

namespace spacearm_proof {

namespace overlapping {

// The least height of a core along a unit vector.
inline double lowest(const PlacedBody& body, Vec3 n) {
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i < body.count; ++i) least = std::min(least, dot(n, vec3(body.points + 3 * i)));
    const double along = dot(n, vec3(body.axis));
    return body.disc > 0 ? least - body.disc * std::sqrt(std::max(1 - along * along, 0.0)) : least;
}
inline void try_along(const PlacedBody& a, const PlacedBody& b, Vec3 n, double& most) {
    const double size = length(n);
    if (!(size > 0)) return;
    n = (1 / size) * n;
    for (const Vec3 to : {n, -1.0 * n}) most = std::max(most, lowest(a, to) + lowest(b, -1.0 * to));
}

}  // namespace overlapping

// The clearance of two such bodies, below 0: by the directions in which one is likely to leave the other soonest, which
// are those from middle to middle and across the faces of boxes and cylinders; of other bodies those of the world.
inline double clearance_of_overlap(const PlacedBody& a, const PlacedBody& b, Vec3 between) {
    using namespace overlapping;
    double most = -std::numeric_limits<double>::infinity();
    try_along(a, b, between, most);
    for (const PlacedBody* body : {&a, &b}) {
        constexpr int corners = 8, neighbours[3] = {4, 2, 1};  // of a box, in the order of the table of bodies
        const Vec3 corner = vec3(body->points);
        if (body->disc > 0) try_along(a, b, vec3(body->axis), most);
        if (body->count == corners) {
            for (const int i : neighbours) try_along(a, b, vec3(body->points + 3 * i) - corner, most);
        } else if (body->count > 2) {
            for (const Vec3 n : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}}) try_along(a, b, n, most);
        }
    }
    return std::min(most, 0.0) - a.radius - b.radius;
}

}  // namespace spacearm_proof
