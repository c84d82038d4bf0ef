#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "stats/sample.h"
#include "stats/window.h"

namespace taihu {

/// A picture that says which part of a photo was searched for holes.
struct PhotoMask {
    /// Its name, with or without folders; "": the one that the mask is named after, as
    /// rock-mask.png after rock.jpg, or the only one.
    std::string photo;
    std::filesystem::path file; ///< PNG of the photo's size, bright where it was searched
};

/// What a file may leave open, and the caller then says.
struct MeasurementSettings {
    std::optional<LengthUnit> unit;    ///< of the lengths; a file that names another is refused
    std::optional<double> unit_per_px; ///< of segments that have none of their own [unit / px], > 0
    std::optional<double> area;        ///< searched in all files together [unit^2], > 0
    std::optional<double> detection_limit; ///< nothing smaller was marked [unit], >= 0
    /// Surface / its image: how much the photos shorten what was searched, 1..100; 1 / cos of the
    /// angle between the surface and the picture. For areas that photos have by themselves.
    std::optional<double> area_factor = std::nullopt;
    Counting counting = Counting::centre; ///< which profiles were marked
    /// True length of the segments labelled `scale` [m], > 0: they give their photo its scale.
    std::optional<double> scale_bar_m = std::nullopt;
    /// Only segments with this label are holes; nothing given: all but those labelled `scale`.
    std::optional<std::string> label = std::nullopt;
    std::vector<PhotoMask> masks = {};
};

/// A photo with holes marked on it.
struct Photo {
    std::string name;                ///< as the file says it; the file's own name where it does not
    int width_px = 0, height_px = 0; ///< 0: not known
    double unit_per_px = 1;          ///< of the sample's unit
    bool masked = false;             ///< a mask says which part was searched
    std::optional<Window> window; ///< the part that was searched, where the size or a mask is known
};

/// A line drawn over a hole of a picture, from rim to rim along its major axis.
struct Segment {
    std::string image, label;
    double x1 = 0, y1 = 0, x2 = 0, y2 = 0; ///< ends [px], y downwards
    double diameter = 0;                   ///< length times unit_per_px [unit]
    std::optional<double> minor_px;        ///< minor axis of the same hole, when it was measured
    std::size_t line = 0;                  ///< in its file, where it is a table, or 0
    std::size_t photo = 0;                 ///< index into Measurements::photos
    bool has_ends = true;                  ///< false: only the length is known, the ends are 0
};

/// A file that numbers came from.
struct SourceFile {
    std::string name;   ///< without folders
    std::string sha256; ///< of its bytes, 64 hexadecimal digits
    friend bool operator==(const SourceFile&, const SourceFile&) = default;
};

/// Planes that cut the same rock: a large hole shows on several of them.
struct SharedHoles {
    std::size_t n_planes = 1;
    double volume = 0; ///< of the rock [unit^3], > 0
};

struct Measurements {
    Sample sample; ///< passes check_sample; one frame a photo, when each has a window
    std::vector<Segment> segments;     ///< when segments were read; in the order of the files
    std::optional<SharedHoles> shared; ///< when all of it is one table of `taihu section`
    std::vector<Photo> photos;         ///< that the segments lie on, in the order of the files
    std::vector<SourceFile> sources;
    std::vector<std::string> warnings; ///< `file:line: what`, worth showing to people
};

/// Hole profiles from files of any of these formats; their content tells which, not their names.
///
/// Tables: CSV with commas, or with semicolons or tabs and then decimal commas too; UTF-8, or
/// UTF-16 with a byte order mark; columns in any order; lines that begin with `#` are comments.
/// - `diameter`: one profile a line.
/// - `diameter_lo,diameter_hi,count`: counts in bins that touch; empty bins have the count 0.
/// - `image,label,x1,y1,x2,y2,unit_per_px` and perhaps `minor`, and `width_px,height_px` of the
///   image: segments in pixels. An empty unit_per_px means: not known.
/// - `plane,u_m,v_m,diameter_m` with `# area_m2=`, and perhaps `# planes=`, `# volume_m3=`: what
///   `taihu section` writes, in metres.
///
/// Chinese column names: 直径 diameter, 直径下限 diameter_lo, 直径上限 diameter_hi, 数量 个数
/// count, 图像 图片 照片 image, 标签 类别 label, 起点x 起点y 终点x 终点y x1 y1 x2 y2 (also X, Y),
/// 每像素长度 unit_per_px, 短轴 minor, 图像宽度 width_px, 图像高度 height_px.
///
/// Segments that other programs keep: labelme JSON, VIA 1 and 2 (CSV, JSON, project), ImageJ (.roi,
/// zip of them, table of results), CVAT for images 1.1. A line or a polyline of two points is a
/// segment; other shapes are left out, and a warning counts them.
///
/// Several files are one sample: diameters are joined, counts add up when the bins are the same;
/// binned and other files do not mix. Images of one name are one photo, in whatever files.
///
/// Scale of a photo: scale_bar_m over the mean length of its segments labelled `scale` (in any
/// case), or its rows' unit_per_px, which must be one, or the setting. All photos have one or none.
///
/// Unit: `# unit=m`, `px` or `greatest` in a table, or the setting, or m where scale bars are used.
/// Without one, segments with no unit_per_px other than 1 are in px; scaled segments and the other
/// kinds must have one. "greatest" means the greatest diameter is 1: segments and photos are
/// divided by their greatest, the others must be so.
///
/// Area: the setting, or `# area=` in unit^2 in every file or none, or the sum of the photos'
/// windows when each has one: the part its mask shows, or else all of the image when its size is
/// known; these are the sample's frames. What lies in the dark of a mask, by its middle, is left
/// out. A given area is refused with segments whose unit is "greatest". Where every segment has its
/// minor axis, the searched surface was seen at a slant: the area (no window) is divided by the
/// mean of minor / major, which is what a picture shortens it by (a circle's image is an ellipse
/// whose major axis keeps the diameter). area_factor says the same where there are none.
///
/// Warnings: what was left out, and how often; two segments with the same ends on one photo; a
/// comment key that looks like a slip of `unit` or `area`; scale bars of one photo that differ;
/// photos without holes, which do not count as searched; photos pooled in pixels.
///
/// \throws Error io: as read_file; bad_input: whatever is not as above, with file, line and column:
///         cells that are no finite number, lengths of 0, ends more than a pixel outside of the
///         image, counts that are no whole number >= 0, bins that do not touch, several scales on
///         one photo, fewer than 8 profiles in all; bad_argument: a setting out of range or that
///         nothing in the files answers to.
Measurements read_measurements(std::span<const std::filesystem::path> paths,
                               const MeasurementSettings& settings = {});

} // namespace taihu
