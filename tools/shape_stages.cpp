#include "tools/shape_stages.h"

#include <array>
#include <cmath>

#include "mesh_out/bump.h"
#include "mesh_out/certificate.h"
#include "mesh_out/io/image_file.h"
#include "mesh_out/io/mesh_file.h"
#include "mesh_out/render.h"
#include "stats/core/error.h"
#include "stats/core/rng.h"
#include "vdb_ops/recipe.h"

namespace taihu {
namespace {

constexpr std::uint32_t kGrainStream = 0x67726169; // "grai"

/// Stone's grain as a solid texture: three octaves of noise in [-1, 1], grains of 2 cm and less.
double grain(const Rng& rng, const Vec3& p) {
    double sum = 0, amplitude = 0.5, per_m = 60;
    for (std::uint32_t octave = 0; octave < 3; ++octave, amplitude *= 0.6, per_m *= 2.3) {
        const Vec3 at = p * per_m;
        const std::array<double, 3> cell{std::floor(at.x), std::floor(at.y), std::floor(at.z)};
        double value = 0;
        for (int corner = 0; corner < 8; ++corner) {
            double weight = 1;
            std::uint64_t item = 0;
            for (int axis = 0; axis < 3; ++axis) {
                const auto a = static_cast<std::size_t>(axis);
                const int step = corner >> axis & 1;
                const double t = at[axis] - cell[a];
                weight *= step ? t : 1 - t;
                item = item << 21 |
                       (static_cast<std::uint64_t>(static_cast<std::int64_t>(cell[a]) + step) &
                        0x1fffff);
            }
            value += weight * (2 * rng.uniform(item, octave) - 1);
        }
        sum += amplitude * value;
    }
    return sum;
}

struct Stage {
    const char* name;
    TriMesh mesh;
    bool lit = false, textured = false;
};

/// The normals of a static bump map on those of the mesh.
std::vector<Vec3> statically_bumped(const TriMesh& mesh, std::uint64_t seed) {
    constexpr int kSide = 512, kRepeats = 2;
    const Image offsets = bump_offsets(static_bump_map(kSide, 0.8, seed), MapBorder::wrap);
    constexpr double kHeight_m = 0.03; // of a rock 1 m wide: 3 m around
    return bumped_normals(mesh, offsets, bounds(mesh), kHeight_m * kSide * kRepeats / 3, kRepeats);
}

std::array<Stage, 9> stages_of(const ShapeSettings& s, StageBump bump) {
    const TriMesh base = fractal_base(s.fractal, s.seed);
    const FractalRefiner refiner(base, s.fractal, s.seed);
    const MidpointMesh displaced = refiner.displace(refiner.start(base));
    const TriMesh damped = refiner.damp(displaced);
    const MidpointMesh again = refiner.displace(damped);
    const TriMesh twice = refiner.damp(again);
    const TriMesh rescaled = fitted(twice, s.size_m);
    TriMesh lit = rescaled;
    lit.normals = averaged_normals(rescaled);

    // The same faces cut in 16 flat ones have a vertex for each of the finer model.
    FractalSettings flat = s.fractal;
    flat.amplitude = flat.roundness = 0;
    const auto cut = [&](const TriMesh& mesh) {
        return FractalRefiner(mesh, flat, s.seed).iterate(mesh, 1);
    };
    TriMesh bumped = cut(rescaled);
    if (bump == StageBump::dynamic) {
        bumped.normals = averaged_normals(fitted(refiner.iterate(twice, 1), s.size_m));
    } else {
        bumped.normals = cut({lit.normals, lit.triangles, {}}).positions; // halves between them
        for (Vec3& n : bumped.normals)
            n = normalized(n);
        bumped.normals = statically_bumped(bumped, s.seed);
    }
    return {{{"1-base", base},
             {"2-displaced", displaced.mesh},
             {"3-damped", damped},
             {"4-displaced-again", again.mesh},
             {"5-damped-again", twice},
             {"6-rescaled", rescaled},
             {"7-lit", lit, true},
             {"8-textured", lit, true, true},
             {"9-bump-mapped", bumped, true, true}}};
}

} // namespace

std::unique_ptr<FileSet> make_stages(const ShapeSettings& settings, StageBump bump,
                                     const std::filesystem::path& folder, const Console& console) {
    if (settings.kind != ShapeKind::fractal_rock ||
        settings.fractal.damping != Damping::interpolating)
        throw Error(Fault::bad_argument, "--stages: are those of a fractal_rock with "
                                         "interpolating damping; ask for one");
    report_stage(console.progress, "stages");
    const bool is_there = std::filesystem::is_directory(folder);
    auto set = std::make_unique<FileSet>(folder);
    const Rng rng{settings.seed, kGrainStream};
    for (const Stage& stage : stages_of(settings, bump)) {
        check_cancelled(console.progress);
        const std::string mesh = std::string(stage.name) + ".glb",
                          picture = std::string(stage.name) + ".png",
                          where = (folder / mesh).string();
        for (const std::string& name : {mesh, picture})
            if (is_there)
                console.may_write(folder / name);
        const std::string bytes = format_mesh(stage.mesh, MeshFormat::glb);
        require_certificate(
            certify(parse_mesh(bytes, MeshFormat::glb, where, {.is_own = true}).levels.at(0)),
            where);
        set->add(mesh, bytes);
        RenderSettings look{.width = 360, .height = 360, .wireframe = !stage.lit};
        if (stage.textured)
            look.albedo_at = [&](const Vec3& p, const Vec3&) {
                return 0.5 * (1 + 0.7 * grain(rng, p));
            };
        const Image image = render(stage.mesh, look, console.progress);
        set->add_by(
            [&](const std::filesystem::path& staging) { write_image(staging / picture, image); });
        console.say("{}: {} triangles", where, stage.mesh.triangles.size());
    }
    set->list();
    return set;
}

} // namespace taihu
