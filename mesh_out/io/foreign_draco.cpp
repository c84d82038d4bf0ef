#include <algorithm>

#include "mesh_out/io/draco_codec_detail.h"
#include "mesh_out/io/foreign_formats_detail.h"
#include "stats/core/error.h"
#include "stats/core/flat.h"
#include "stats/core/foreign.h"

namespace taihu {

namespace {

void put_mesh(FlatWriter& out, const DracoMesh& decoded) {
    out.put_all(std::span(decoded.mesh.positions));
    out.put_all(std::span(decoded.mesh.triangles));
    out.put_all(std::span(decoded.mesh.normals));
    out.put_all(std::span(decoded.mesh.openness));
    out.put(decoded.position_id);
    for (const auto& id : {decoded.normal_id, decoded.colour_id}) {
        out.put<std::uint8_t>(id.has_value());
        out.put<std::uint32_t>(id.value_or(0));
    }
    out.put_text(decoded.recipe);
    out.put_all(std::span(decoded.ids));
}

DracoMesh get_mesh(FlatReader& in) {
    DracoMesh out;
    TriMesh& mesh = out.mesh;
    mesh.positions = in.get_all<std::vector<Vec3>>();
    mesh.triangles = in.get_all<std::vector<Triangle>>();
    mesh.normals = in.get_all<std::vector<Vec3>>();
    mesh.openness = in.get_all<std::vector<float>>();
    out.position_id = in.get<std::uint32_t>();
    for (auto* id : {&out.normal_id, &out.colour_id}) {
        const bool has = in.get<std::uint8_t>() != 0;
        const auto value = in.get<std::uint32_t>();
        if (has)
            *id = value;
    }
    out.recipe = in.get_text();
    out.ids = in.get_all<std::vector<std::uint32_t>>();
    const std::size_t n = mesh.positions.size();
    const auto fits = [n](std::size_t size) { return size == 0 || size == n; };
    if (!fits(mesh.normals.size()) || !fits(mesh.openness.size()) ||
        !std::all_of(mesh.positions.begin(), mesh.positions.end(), is_finite) ||
        !std::all_of(mesh.normals.begin(), mesh.normals.end(), is_finite) ||
        !std::all_of(mesh.openness.begin(), mesh.openness.end(),
                     [](float o) { return o >= 0 && o <= 1; }) ||
        !std::all_of(mesh.triangles.begin(), mesh.triangles.end(),
                     [n](const Triangle& t) { return t[0] < n && t[1] < n && t[2] < n; }))
        in.fail("is no mesh");
    return out;
}

} // namespace

std::string flat_draco(std::string_view bytes, const std::string& where,
                       const std::vector<std::string>& /*words*/) {
    FlatReader in(bytes, where);
    FlatWriter out;
    for (auto left = in.get<std::uint64_t>(); left > 0; --left) {
        const std::string place = in.get_text();
        put_mesh(out, decode_draco_mesh(in.get_text(), place));
    }
    return std::move(out.bytes);
}

namespace {

/// Of some streams in one program.
std::vector<DracoMesh> read_batch(std::span<const DracoStream> streams, const std::string& where,
                                  Progress* progress) {
    FlatWriter all;
    all.put<std::uint64_t>(streams.size());
    for (const DracoStream& s : streams) {
        all.put_text(s.where);
        all.put_text(s.bytes);
    }
    const std::string& place = streams.size() == 1 ? streams.front().where : where;
    const std::string flat = read_foreign("draco", all.bytes, place, {}, progress);
    FlatReader in(flat, place);
    std::vector<DracoMesh> meshes;
    for (std::size_t i = 0; i < streams.size(); ++i)
        meshes.push_back(get_mesh(in));
    in.expect_end();
    return meshes;
}

/// In halves where all are more than a program may take, which is meant for one.
void read_all(std::span<const DracoStream> streams, const std::string& where, Progress* progress,
              std::vector<DracoMesh>& into) {
    try {
        for (DracoMesh& mesh : read_batch(streams, where, progress))
            into.push_back(std::move(mesh));
    } catch (const Error& e) {
        if (e.fault() != Fault::bad_input || streams.size() == 1)
            throw;
        read_all(streams.first(streams.size() / 2), where, progress, into);
        read_all(streams.subspan(streams.size() / 2), where, progress, into);
    }
}

} // namespace

std::vector<DracoMesh> read_draco(std::span<const DracoStream> streams, const std::string& where,
                                  bool is_own, std::size_t most_items, Progress* progress) {
    constexpr std::size_t kBatch = 32;
    std::vector<DracoMesh> meshes;
    std::size_t n_items = 0;
    for (std::size_t first = 0; first < streams.size(); first += kBatch) {
        const auto batch = streams.subspan(first, std::min(kBatch, streams.size() - first));
        if (!is_own)
            read_all(batch, where, progress, meshes);
        for (const DracoStream& s : batch)
            if (is_own)
                meshes.push_back(decode_draco_mesh(s.bytes, s.where));
        for (std::size_t i = first; i < meshes.size(); ++i)
            n_items += meshes[i].mesh.positions.size() + meshes[i].mesh.triangles.size();
        if (n_items > most_items)
            throw Error(Fault::bad_input, where + ": its Draco streams unfold into over " +
                                              std::to_string(most_items) +
                                              " vertices and triangles; split the file");
    }
    return meshes;
}

} // namespace taihu
