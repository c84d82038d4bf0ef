#include "mesh_out/measure.h"

#include <cstdio>
#include <memory>

extern "C" {
#include <libqhull_r/qhull_ra.h>
}

#include "stats/core/error.h"

namespace taihu {

double hull_volume_m3(const TriMesh& mesh) {
    if (mesh.triangles.empty())
        throw Error(Fault::bad_argument, "hull: the mesh has no triangle; give one that has");
    if (mesh.positions.size() < 4)
        return 0; // in a plane, and Qhull would call it an error
    std::vector<coordT> points;
    points.reserve(3 * mesh.positions.size());
    for (const Vec3& p : mesh.positions) {
        if (!is_finite(p))
            throw Error(Fault::bad_argument, "hull: a position is not finite; repair the mesh");
        points.insert(points.end(), {p.x, p.y, p.z});
    }
    // Qhull writes its complaints to a stream; nobody reads this one.
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> silence(std::fopen("/dev/null", "w"),
                                                                  std::fclose);
    qhT state{};
    qh_zero(&state, silence.get());
    char options[] = "qhull FA Pp";
    const int code = qh_new_qhull(&state, 3, static_cast<int>(mesh.positions.size()), points.data(),
                                  False, options, nullptr, silence.get());
    double volume = 0;
    if (code == qh_ERRnone) {
        qh_getarea(&state, state.facet_list);
        volume = state.totvol;
    }
    qh_freeqhull(&state, !qh_ALL);
    int n_long = 0, bytes_long = 0;
    qh_memfreeshort(&state, &n_long, &bytes_long);
    if (code != qh_ERRnone && code != qh_ERRsingular)
        throw Error(Fault::numeric,
                    "hull: Qhull gave up with code " + std::to_string(code) + "; check the mesh");
    return volume;
}

} // namespace taihu
