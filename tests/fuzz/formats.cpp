#include "tests/fuzz/formats.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <zlib.h>

#include "mesh_out/io/image_file.h"
#include "mesh_out/io/mesh_file.h"
#include "mesh_out/io/relief_file.h"
#include "stats/core/error.h"
#include "stats/io/holes_file.h"
#include "stats/io/law_file.h"
#include "stats/io/measurements.h"
#include "stats/io/photo_mask_detail.h"
#include "tests/support/mutate.h"
#include "vdb_ops/recipe.h"
#include "vdb_ops/relief.h"

namespace taihu {
namespace {

namespace fs = std::filesystem;

void check_level(const TriMesh& mesh) {
    demand(!mesh.triangles.empty(), "a mesh without triangles");
    for (const Triangle& t : mesh.triangles)
        for (const std::uint32_t corner : t)
            demand(corner < mesh.positions.size(), "an index past the last position");
    const auto finite = [](const std::vector<Vec3>& list) {
        return std::all_of(list.begin(), list.end(), [](const Vec3& v) { return is_finite(v); });
    };
    demand(finite(mesh.positions), "a position that is not finite");
    demand(finite(mesh.normals), "a normal that is not finite");
    demand(mesh.normals.empty() || mesh.normals.size() == mesh.positions.size(),
           "as many normals as no positions");
    demand(std::all_of(mesh.openness.begin(), mesh.openness.end(),
                       [](float v) { return std::isfinite(v); }),
           "an openness that is not finite");
}

template <MeshFormat format>
void read_mesh_bytes(const std::string& bytes, const fs::path&) {
    static const std::string where =
        "mutant." + std::string("objplystloffglbdrc").substr(3 * std::size_t(format), 3);
    const MeshFile file = parse_mesh(bytes, format, where);
    for (const TriMesh& level : file.levels)
        check_level(level);
    demand(std::all_of(file.coverages.begin(), file.coverages.end(),
                       [](double v) { return std::isfinite(v); }),
           "a coverage that is not finite");
    (void)recipe_solid(file.recipe); // what `info` and `rock --from` do with it
}

void read_exr_bytes(const std::string& bytes, const fs::path& folder) {
    const ReliefTile tile = read_relief(in_file(bytes, folder, "mutant.exr"));
    const Image& heights = tile.heights;
    demand(heights.width >= 2 && heights.height >= 2 && heights.channels == 1, "no heights");
    demand(heights.pixels.size() == std::size_t(heights.width) * std::size_t(heights.height),
           "as many heights as no pixels");
    demand(std::all_of(heights.pixels.begin(), heights.pixels.end(),
                       [](float h) { return std::isfinite(h); }),
           "a height that is not finite");
    demand(std::isfinite(tile.pixel_m) && tile.pixel_m >= 0, "a pixel without a size");
}

void read_png_bytes(const std::string& bytes, const fs::path& folder) {
    const fs::path path = in_file(bytes, folder, "mutant.png");
    const Image image = read_png(path), mask = read_photo_mask(path);
    demand(image.width == mask.width && image.height == mask.height, "two sizes");
    demand(image.pixels.size() ==
               std::size_t(image.width) * std::size_t(image.height) * std::size_t(image.channels),
           "as many samples as no pixels");
    demand(std::all_of(image.pixels.begin(), image.pixels.end(),
                       [](float v) { return v >= 0 && v <= 1; }),
           "a sample outside of 0..1");
}

void read_holes_bytes(const std::string& bytes, const fs::path& folder) {
    for (const Sphere& hole : read_holes(in_file(bytes, folder, "mutant.csv")))
        demand(is_finite(hole.center) && hole.radius_m > 0 && std::isfinite(hole.radius_m),
               "a hole that is none");
}

void read_marks(const fs::path& path) {
    const Measurements m = read_measurements(std::span(&path, 1));
    const auto good = [](double v) { return v > 0 && std::isfinite(v); };
    demand(std::all_of(m.sample.diameters.begin(), m.sample.diameters.end(), good),
           "a diameter that is none");
    for (const Segment& s : m.segments)
        demand(good(s.diameter) && s.photo < m.photos.size(), "a segment that is none");
    demand(!m.sample.area || good(*m.sample.area), "an area that is none");
}

template <const char* const& name>
void read_marks_bytes(const std::string& bytes, const fs::path& folder) {
    read_marks(in_file(bytes, folder, name));
}

constexpr const char *kCsv = "mutant.csv", *kJson = "mutant.json", *kXml = "mutant.xml",
                     *kZip = "mutant.zip";

/// Ten times over, because a sample has eight or more.
void read_roi_bytes(const std::string& bytes, const fs::path& folder) {
    std::vector<fs::path> paths;
    for (int i = 0; i < 10; ++i)
        paths.push_back(in_file(bytes, folder, ("mutant" + std::to_string(i) + ".roi").c_str()));
    (void)read_measurements(paths);
}

void read_law_bytes(const std::string& bytes, const fs::path&) {
    const LawFile file = parse_law_file(bytes, kJson);
    demand(std::isfinite(file.law.mean()) && file.law.mean() > 0, "a law without a mean");
    demand(parse_law_file(format_law_file(file), kJson) == file, "written, it reads otherwise");
}

void read_relief_bytes(const std::string& bytes, const fs::path&) {
    const ReliefSettings settings = parse_relief(bytes, kJson);
    demand(parse_relief(format_relief(settings), kJson).pixel_m == settings.pixel_m,
           "written, it reads otherwise");
}

std::uint32_t big_word(const std::string& bytes, std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t k = 0; k < 4; ++k)
        value = value << 8 | static_cast<unsigned char>(bytes[at + k]);
    return value;
}

void mend_png(std::string& bytes) {
    for (std::size_t at = 8; at + 12 <= bytes.size();) {
        const std::size_t length = big_word(bytes, at);
        if (length > bytes.size() - at - 12)
            return;
        const auto* from = reinterpret_cast<const Bytef*>(bytes.data() + at + 4);
        const auto sum = crc32(0, from, static_cast<uInt>(length + 4));
        for (std::size_t k = 0; k < 4; ++k)
            bytes[at + 8 + length + k] = static_cast<char>(sum >> (24 - 8 * k));
        at += 12 + length;
    }
}

void set_little(std::string& bytes, std::size_t at, std::size_t value) {
    for (std::size_t k = 0; k < 4; ++k)
        bytes[at + k] = static_cast<char>(value >> (8 * k));
}

/// The length of the file, and where damage moved the second chunk, that of the first.
void mend_glb(std::string& bytes) {
    if (bytes.size() < 20)
        return;
    set_little(bytes, 8, bytes.size());
    const std::size_t bin = bytes.find(std::string("BIN\0", 4));
    if (bin == std::string::npos || bin < 24)
        return;
    set_little(bytes, 12, bin - 4 - 20);
    set_little(bytes, bin - 4, bytes.size() - bin - 4);
}

/// The number of triangles of a binary file.
void mend_stl(std::string& bytes) {
    if (bytes.size() >= 84 && !bytes.starts_with("solid")) {
        bytes.resize(84 + (bytes.size() - 84) / 50 * 50);
        set_little(bytes, 80, (bytes.size() - 84) / 50);
    }
}

constexpr FuzzFormat kFormats[] = {
    {"cvat", "mutant.xml", cvat_bases, read_marks_bytes<kXml>},
    {"drc", "mutant.drc", drc_bases, read_mesh_bytes<MeshFormat::drc>},
    {"exr", "mutant.exr", exr_bases, read_exr_bytes},
    {"glb", "mutant.glb", glb_bases, read_mesh_bytes<MeshFormat::glb>, mend_glb},
    {"holes", "mutant.csv", holes_bases, read_holes_bytes},
    {"labelme", "mutant.json", labelme_bases, read_marks_bytes<kJson>},
    {"law", "mutant.json", law_bases, read_law_bytes},
    {"obj", "mutant.obj", obj_bases, read_mesh_bytes<MeshFormat::obj>},
    {"off", "mutant.off", off_bases, read_mesh_bytes<MeshFormat::off>},
    {"ply", "mutant.ply", ply_bases, read_mesh_bytes<MeshFormat::ply>},
    {"png", "mutant.png", png_bases, read_png_bytes, mend_png},
    {"recipe", "mutant.json", recipe_bases, read_recipe_bytes},
    {"relief", "mutant.json", relief_bases, read_relief_bytes},
    {"roi", "mutant.roi", roi_bases, read_roi_bytes},
    {"stl", "mutant.stl", stl_bases, read_mesh_bytes<MeshFormat::stl>, mend_stl},
    {"table", "mutant.csv", table_bases, read_marks_bytes<kCsv>},
    {"tiles", "mutant.json", tiles_bases, read_tiles_bytes},
    {"vdb", "mutant.vdb", vdb_bases, read_vdb_bytes},
    {"via", "mutant.json", via_bases, read_marks_bytes<kJson>},
    {"zip", "mutant.zip", zip_bases, read_marks_bytes<kZip>}};

} // namespace

void demand(bool sound, const char* what) {
    if (!sound)
        throw Unsound(what);
}

fs::path in_file(const std::string& bytes, const fs::path& folder, const char* name) {
    const fs::path path = folder / name;
    std::ofstream(path, std::ios::binary).write(bytes.data(), std::streamsize(bytes.size()));
    return path;
}

std::span<const FuzzFormat> fuzz_formats() {
    return kFormats;
}

std::string mutated_file(const FuzzFormat& format, std::span<const std::string> bases,
                         std::uint64_t seed, std::uint64_t item) {
    std::string bytes = mutate(bases, seed, item).bytes;
    if (format.mend && item % 2 == 1)
        format.mend(bytes);
    return bytes;
}

} // namespace taihu
