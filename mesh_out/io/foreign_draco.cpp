#include <algorithm>

#include "mesh_out/io/draco_codec_detail.h"
#include "mesh_out/io/foreign_formats_detail.h"
#include "stats/core/flat.h"
#include "stats/core/foreign.h"

namespace taihu {

std::string flat_draco(std::string_view bytes, const std::string& where,
                       const std::vector<std::string>& /*words*/) {
    const DracoMesh decoded = decode_draco_mesh(bytes, where);
    FlatWriter out;
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
    return std::move(out.bytes);
}

DracoMesh read_draco(std::string_view bytes, const std::string& where, bool is_own,
                     Progress* progress) {
    if (is_own)
        return decode_draco_mesh(bytes, where);
    const std::string flat = read_foreign("draco", bytes, where, {}, progress);
    FlatReader in(flat, where);
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
    in.expect_end();
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

} // namespace taihu
