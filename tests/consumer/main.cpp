// The twelve lines of C++ of the README, as a program.
#include <cstdio>

#include "mesh_out/surface_file.h"
#include "stats/core/file.h"
#include "vdb_ops/balls_field.h"
#include "vdb_ops/carve.h"
#include "vdb_ops/clean.h"
#include "vdb_ops/csg_field.h"
#include "vdb_ops/place.h"
#include "vdb_ops/rasterize.h"
#include "vdb_ops/shapes.h"

int main() {
    using namespace taihu;
    const std::shared_ptr<const Field> ball = shape_field({.kind = ShapeKind::sphere});
    const auto base = rasterize(*ball, {.voxel_m = 0.02});
    const auto holes = place_holes(Law::exponential(5), {.porosity = 0.2}, *base).holes;
    const auto rock = clean(*carve(*base, holes).rock).solid;
    const DifferenceField field(ball, std::make_shared<BallsField>(holes)); // makes rims sharp
    const SurfaceFile file =
        format_surface(*rock, &field, MeshFormat::glb, {.max_error_m = 0.01}, "");
    write_file("rock.glb", file.bytes);
    std::printf("%zu triangles, genus %lld\n", file.certificate.n_triangles,
                static_cast<long long>(file.certificate.genus));
    return file.certificate.holds() ? 0 : 1;
}
