#pragma once
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

namespace taihu {

/// A segment on rock01.jpg, which has 560 x 450 px.
struct Drawn {
    int x1, y1, x2, y2;
    std::string label = "hole";
};

/// Eight holes in all directions, none of them along an axis alone.
inline std::vector<Drawn> eight_holes() {
    return {{188, 178, 160, 224}, {30, 40, 33, 44},     {100, 90, 106, 98},   {200, 300, 195, 312},
            {400, 20, 408, 5},    {500, 400, 521, 420}, {350, 250, 341, 290}, {60, 410, 67, 434}};
}

inline std::string csv_text(const std::vector<Drawn>& drawn, const std::string& scale = "") {
    std::string text = "image,label,x1,y1,x2,y2,unit_per_px\n";
    for (const Drawn& d : drawn)
        text += "rock01.jpg," + d.label + "," + std::to_string(d.x1) + "," + std::to_string(d.y1) +
                "," + std::to_string(d.x2) + "," + std::to_string(d.y2) + "," + scale + "\n";
    return text;
}

inline std::string labelme_text(const std::vector<Drawn>& drawn,
                                const std::string& image = "rock01.jpg") {
    std::string text = R"({"version":"5.4.1","flags":{},"shapes":[)";
    for (const Drawn& d : drawn)
        text += (text.back() == '[' ? "" : ",") + std::string(R"({"label":")") + d.label +
                R"(","points":[[)" + std::to_string(d.x1) + ".0," + std::to_string(d.y1) + ".0],[" +
                std::to_string(d.x2) + ".0," + std::to_string(d.y2) +
                R"(.0]],"group_id":null,"shape_type":"line","flags":{}})";
    return text + R"(],"imagePath":"..\\photos\\)" + image +
           R"(","imageData":null,"imageHeight":450,"imageWidth":560})";
}

inline std::string via_shape(const Drawn& d) {
    return R"({"name":"polyline","all_points_x":[)" + std::to_string(d.x1) + "," +
           std::to_string(d.x2) + R"(],"all_points_y":[)" + std::to_string(d.y1) + "," +
           std::to_string(d.y2) + "]}";
}

enum class ViaRegions { list, object };

inline std::string via_json_text(const std::vector<Drawn>& drawn,
                                 ViaRegions form = ViaRegions::list) {
    const bool list = form == ViaRegions::list;
    std::string regions;
    for (std::size_t i = 0; i < drawn.size(); ++i)
        regions += (i > 0 ? "," : "") + (list ? "" : "\"" + std::to_string(i) + "\":") +
                   R"({"shape_attributes":)" + via_shape(drawn[i]) +
                   R"(,"region_attributes":{"type":")" + drawn[i].label + R"("}})";
    return R"({"rock01.jpg299751":{"filename":"rock01.jpg","size":299751,"regions":)" +
           (list ? "[" + regions + "]" : "{" + regions + "}") + R"(,"file_attributes":{}}})";
}

inline std::string via_project_text(const std::vector<Drawn>& drawn) {
    return R"({"_via_settings":{"ui":{}},"_via_img_metadata":)" + via_json_text(drawn) +
           R"(,"_via_attributes":{"region":{},"file":{}}})";
}

inline std::string quoted_cell(const std::string& text) {
    std::string cell = "\"";
    for (const char c : text)
        cell += c == '"' ? std::string("\"\"") : std::string(1, c);
    return cell + "\"";
}

/// \param mark  "#" for version 1
inline std::string via_csv_text(const std::vector<Drawn>& drawn, const std::string& mark = "") {
    std::string text = mark + "filename,file_size,file_attributes,region_count,region_id,"
                              "region_shape_attributes,region_attributes\n";
    for (std::size_t i = 0; i < drawn.size(); ++i)
        text += "rock01.jpg,299751,\"{}\"," + std::to_string(drawn.size()) + "," +
                std::to_string(i) + "," + quoted_cell(via_shape(drawn[i])) + "," +
                quoted_cell(R"({"type":")" + drawn[i].label + R"("})") + "\n";
    return text;
}

inline std::string cvat_text(const std::vector<Drawn>& drawn) {
    std::string text = "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<annotations>\n"
                       "  <version>1.1</version>\n"
                       "  <image id=\"0\" name=\"rock01.jpg\" width=\"560\" height=\"450\">\n";
    for (const Drawn& d : drawn)
        text += "    <polyline points=\"" + std::to_string(d.x1) + ".00," + std::to_string(d.y1) +
                ".00;" + std::to_string(d.x2) + ".00," + std::to_string(d.y2) + ".00\" label=\"" +
                d.label + "\" occluded=\"0\" z_order=\"0\"></polyline>\n";
    return text + "  </image>\n</annotations>\n";
}

inline std::string imagej_results_text(const std::vector<Drawn>& drawn) {
    std::string text = " ,Label,Area,Mean,Min,Max,BX,BY,Width,Height,Angle,Length\n";
    for (std::size_t i = 0; i < drawn.size(); ++i) {
        const Drawn& d = drawn[i];
        const double dx = d.x2 - d.x1, dy = d.y2 - d.y1;
        text += std::to_string(i + 1) + ",rock01.jpg:" + d.label + ",54,131.2,88,190," +
                std::to_string(std::min(d.x1, d.x2)) + "," + std::to_string(std::min(d.y1, d.y2)) +
                "," + std::to_string(std::abs(d.x2 - d.x1)) + "," +
                std::to_string(std::abs(d.y2 - d.y1)) + "," +
                std::to_string(std::atan2(-dy, dx) * 180 / std::numbers::pi) + "," +
                std::to_string(std::hypot(dx, dy)) + "\n";
    }
    return text;
}

/// `n_bytes` of `value`, the greatest first.
inline std::string big_endian(std::uint32_t value, int n_bytes) {
    std::string bytes;
    for (int i = n_bytes - 1; i >= 0; --i)
        bytes += static_cast<char>(value >> (8 * i) & 0xff);
    return bytes;
}

inline std::string roi_bytes(const Drawn& d, char type = 3) {
    const auto f32 = [](int value) {
        return big_endian(std::bit_cast<std::uint32_t>(static_cast<float>(value)), 4);
    };
    std::string bytes(64, '\0');
    bytes.replace(0, 4, "Iout");
    bytes.replace(4, 2, big_endian(228, 2));
    bytes[6] = type;
    bytes.replace(18, 16, f32(d.x1) + f32(d.y1) + f32(d.x2) + f32(d.y2));
    bytes.replace(60, 4, big_endian(64, 4)); // a second header, without a name inside
    return bytes + std::string(64, '\0');
}

/// The checksum of zips and PNGs.
inline std::uint32_t crc32_of(const std::string& bytes) {
    std::uint32_t crc = 0xffffffffu;
    for (const char c : bytes) {
        crc ^= static_cast<unsigned char>(c);
        for (int bit = 0; bit < 8; ++bit)
            crc = crc >> 1 ^ (crc & 1 ? 0xedb88320u : 0u);
    }
    return ~crc;
}

struct ZipEntry {
    std::string name, bytes;
};

/// A zip whose entries are stored as they are.
inline std::string zip_bytes(const std::vector<ZipEntry>& entries) {
    const auto little = [](std::uint32_t value, int n_bytes) {
        std::string bytes = big_endian(value, n_bytes);
        std::reverse(bytes.begin(), bytes.end());
        return bytes;
    };
    const auto size = [](const std::string& s) { return static_cast<std::uint32_t>(s.size()); };
    std::string files, directory;
    for (const auto& [name, bytes] : entries) {
        const std::string common = little(0, 4) + little(0, 4) + little(crc32_of(bytes), 4) +
                                   little(size(bytes), 4) + little(size(bytes), 4) +
                                   little(size(name), 2) + little(0, 2);
        directory += "PK\x01\x02" + little(20, 2) + little(20, 2) + common + little(0, 2) +
                     little(0, 2) + little(0, 2) + little(0, 4) + little(size(files), 4) + name;
        files += "PK\x03\x04" + little(20, 2) + common + name + bytes;
    }
    const auto n = static_cast<std::uint32_t>(entries.size());
    return files + directory + "PK\x05\x06" + little(0, 4) + little(n, 2) + little(n, 2) +
           little(size(directory), 4) + little(size(files), 4) + little(0, 2);
}

inline std::string roi_zip_bytes(const std::vector<Drawn>& drawn) {
    std::vector<ZipEntry> entries;
    for (std::size_t i = 0; i < drawn.size(); ++i)
        entries.push_back({drawn[i].label + (i > 0 ? "-" + std::to_string(i) : "") + ".roi",
                           roi_bytes(drawn[i])});
    return zip_bytes(entries);
}

} // namespace taihu
