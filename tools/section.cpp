// taihu section: a solid cut by planes, its holes as profiles and as labelled photos.
#include "vdb_ops/section.h"

#include "mesh_out/io/image_file.h"
#include "stats/core/error.h"
#include "stats/core/file_set.h"
#include "stats/io/holes_file.h"
#include "stats/io/labelme_writer.h"
#include "tools/solid_files.h"
#include "vdb_ops/section_photo.h"

namespace taihu {
namespace {

struct PhotoArgs {
    std::filesystem::path folder;
    std::string pixel, tilt, detection_limit, scale_bar;

    SectionPhotoSettings settings(const Measure& measure) const {
        const auto length = [&](const char* option, const std::string& text) {
            return text.empty() ? std::optional<double>()
                                : std::optional(length_m(option, text, measure));
        };
        SectionPhotoSettings s;
        s.pixel_m = length("--pixel", pixel);
        s.detection_limit_m = length("--detection-limit", detection_limit);
        s.scale_bar_m = length("--scale-bar", scale_bar);
        if (!tilt.empty())
            s.tilt_deg = angle_deg("--tilt", tilt);
        return s;
    }
};

struct SectionArgs {
    SolidOptions solid;
    std::filesystem::path base, holes, out;
    std::vector<double> direction;
    bool major = false;
    SectionSettings settings;
    PhotoArgs photos;
};

/// The files of one photo, in a folder.
struct PhotoFiles {
    std::filesystem::path picture, mask, labels;
    PhotoFiles(const std::filesystem::path& folder, std::size_t plane) {
        const std::string stem = "plane-" + std::to_string(plane + 1);
        picture = folder / (stem + ".png");
        mask = folder / (stem + "-mask.png");
        labels = folder / (stem + ".json");
    }
};

/// What all photos of a run are together, and what they share.
struct PhotoTotals {
    std::size_t n_photos = 0, n_marked = 0, n_small = 0, n_inside = 0, n_solid = 0;
    double area_m2 = 0, pixel_m = 0, detection_limit_m = 0, scale_bar_m = 0, area_factor = 1;

    void add(const SectionPhoto& photo) {
        ++n_photos;
        n_marked += photo.holes.size();
        n_small += photo.n_small;
        n_inside += photo.n_inside;
        n_solid += photo.n_solid;
        area_m2 += photo.area_m2;
        pixel_m = photo.pixel_m;
        detection_limit_m = photo.detection_limit_m;
        scale_bar_m = photo.scale_bar.diameter;
        area_factor = photo.area_factor;
    }
};

void check_folder(const SectionArgs& args, const Console& console) {
    const std::filesystem::path& folder = args.photos.folder;
    std::error_code ignored;
    for (int i = 0; i < args.settings.n_planes && std::filesystem::is_directory(folder, ignored);
         ++i) {
        const PhotoFiles files(folder, static_cast<std::size_t>(i));
        for (const auto& file : {files.picture, files.mask, files.labels})
            console.may_write(file, {args.solid.path, args.base, args.holes, args.out});
    }
}

void write_photo(const SectionPhoto& photo, const PhotoFiles& files) {
    write_image(files.picture, photo.picture);
    write_image(files.mask, photo.mask);
    std::vector<Segment> segments = photo.holes;
    segments.push_back(photo.scale_bar);
    write_file(files.labels, format_labelme(base_name(files.picture), photo.picture.width,
                                            photo.picture.height, segments));
}

PhotoTotals write_photos(const Section& cut, const openvdb::FloatGrid& solid,
                         const SectionKnown& known, const SectionArgs& args,
                         const SectionPhotoSettings& settings, FileSet& set,
                         const Console& console) {
    PhotoTotals totals;
    for (std::size_t i = 0; i < cut.planes.size(); ++i) {
        const PhotoFiles files(args.photos.folder, i);
        if (!(cut.planes[i].area_m2 > 0)) {
            console.say("{}: the plane misses the solid: no photo", files.picture.string());
            continue;
        }
        const SectionPhoto photo =
            section_photo(solid, known, cut.planes[i], settings, console.progress);
        set.add_by([&](const std::filesystem::path& folder) {
            write_photo(photo, PhotoFiles(folder, i));
        });
        console.say("{}: {} x {} pixels, {} holes marked", files.labels.string(),
                    photo.picture.width, photo.picture.height, photo.holes.size());
        totals.add(photo);
    }
    return totals;
}

void tell_photos(const PhotoTotals& totals, const SectionArgs& args, const Console& console) {
    const std::string folder = args.photos.folder.string();
    console.say("{}: {} holes marked on {} photos; {} profiles below the detection limit, {} "
                "inside others",
                folder, totals.n_marked, totals.n_photos, totals.n_small, totals.n_inside);
    if (totals.n_solid > 0)
        console.say("{}: {} profiles of the table are solid here and not marked: a fit will miss "
                    "them; carve with --bubbles keep",
                    folder, totals.n_solid);
    if (totals.n_marked == 0)
        return;
    console.say(
        "fit with: taihu fit {0}/plane-*.json --mask {0}/plane-*-mask.png --scale-bar {1:.10g}m "
        "--detection-limit {2:.10g}",
        folder, totals.scale_bar_m, totals.detection_limit_m);
    if (totals.area_factor > 1)
        console.say("the tilt shortens the area that they show: fit with --area-factor {:.6g}, or "
                    "holes per volume come out {:.1f} % too many",
                    totals.area_factor, 100 * (totals.area_factor - 1));
}

nlohmann::ordered_json photos_json(const PhotoTotals& totals, const SectionArgs& args) {
    return {{"folder", args.photos.folder.string()},
            {"photos", totals.n_photos},
            {"marked", totals.n_marked},
            {"small", totals.n_small},
            {"inside", totals.n_inside},
            {"solid", totals.n_solid},
            {"area_m2", totals.area_m2},
            {"pixel_m", totals.pixel_m},
            {"detection_limit_m", totals.detection_limit_m},
            {"scale_bar_m", totals.scale_bar_m},
            {"area_factor", totals.area_factor}};
}

nlohmann::ordered_json section_json(const Section& cut, std::ptrdiff_t n_clipped,
                                    const std::string& out) {
    nlohmann::ordered_json json;
    if (!out.empty())
        json["file"] = out;
    json.update({{"planes", cut.planes.size()},
                 {"profiles", cut.profiles.size()},
                 {"area_m2", cut.area_m2},
                 {"resolution_m", cut.resolution_m},
                 {"small", cut.n_small},
                 {"clipped", n_clipped}});
    return json;
}

void tell(const Section& cut, std::ptrdiff_t n_clipped, const SectionArgs& args,
          const Console& console) {
    console.say("{}: {} profiles on {} planes, {:.4g} m^2", args.out.string(), cut.profiles.size(),
                cut.planes.size(), cut.area_m2);
    if (!args.holes.empty())
        return;
    console.say("{} regions below {:.4g} m left out; fit with --detection-limit {:.4g}",
                cut.n_small, cut.resolution_m, cut.resolution_m);
    if (n_clipped > 0)
        console.say("{} profiles are open to the air: larger than they look", n_clipped);
}

/// What a run reads.
struct Inputs {
    Solid solid, base;
    std::vector<Sphere> holes;
    SectionKnown known;
};

void read_inputs(const SectionArgs& args, const Console& console, Inputs& in) {
    in.solid = read_solid(args.solid, console);
    if (!args.base.empty()) {
        SolidOptions options = args.solid;
        options.path = args.base;
        in.base = read_solid(options, console);
        in.known.base = in.base.grid.get();
    }
    if (!args.holes.empty()) {
        in.holes = read_holes(args.holes);
        in.known.holes = in.holes;
    }
}

void run(SectionArgs args, const Console& console) {
    const bool has_photos = !args.photos.folder.empty();
    if (args.out.empty() && !has_photos)
        throw Error(Fault::bad_argument,
                    "section: nothing to write; give -o profiles.csv, --photos DIR, or both");
    if (!args.out.empty() && args.out.extension() != ".csv")
        throw Error(Fault::unsupported, args.out.string() + ": profiles are a table; name a .csv");
    if (!args.out.empty())
        console.may_write(args.out, {args.solid.path, args.base, args.holes});
    std::optional<FileSet> photos;
    if (has_photos) {
        check_folder(args, console);
        photos.emplace(args.photos.folder);
    }
    if (!args.direction.empty())
        args.settings.direction = {args.direction[0], args.direction[1], args.direction[2]};
    Inputs in;
    read_inputs(args, console, in);
    const SectionPhotoSettings photo_settings = args.photos.settings(in.solid.measure);
    const Section cut = section(*in.solid.grid, in.known, args.settings, console.progress);
    const auto n_clipped = std::count_if(cut.profiles.begin(), cut.profiles.end(),
                                         [](const Profile& p) { return p.clipped; });
    auto json = section_json(cut, n_clipped, args.out.string());
    OutputFiles table;
    if (!args.out.empty()) {
        table.add(args.out, format_profiles(cut, args.major));
        tell(cut, n_clipped, args, console);
    }
    if (has_photos) {
        const PhotoTotals totals =
            write_photos(cut, *in.solid.grid, in.known, args, photo_settings, *photos, console);
        photos->list();
        tell_photos(totals, args, console);
        json["photos"] = photos_json(totals, args);
    }
    const Publishing together;
    check_cancelled(console.progress);
    if (photos)
        photos->publish(kFileListName);
    table.publish();
    console.result(json);
}

void add_photo_options(CLI::App& verb, PhotoArgs& photos) {
    const std::string group = "Photos";
    auto* folder =
        verb.add_option("--photos", photos.folder,
                        "Folder for a photo of each plane with its holes marked, which fit reads: "
                        "plane-1.png, plane-1.json (labelme), plane-1-mask.png")
            ->group(group);
    verb.add_option("--pixel", photos.pixel, "Side of a pixel: 2mm [1/800 of the longest axis]")
        ->needs(folder)
        ->group(group);
    verb.add_option("--tilt", photos.tilt,
                    "Of the eye from straight above, 0..80: 25deg; holes become ellipses [0deg]")
        ->needs(folder)
        ->group(group);
    verb.add_option("--detection-limit", photos.detection_limit,
                    "Nothing smaller is marked: 1cm [4 pixels, and 2 voxels]")
        ->needs(folder)
        ->group(group);
    verb.add_option("--scale-bar", photos.scale_bar,
                    "Length of the bar in the picture: 20cm [a round length]")
        ->needs(folder)
        ->group(group);
}

} // namespace

void add_section(CLI::App& app, Console& console) {
    auto args = std::make_shared<SectionArgs>();
    auto* verb = console.verb(
        app, "section", "Cut a solid by planes and measure its holes",
        "  taihu section rock.vdb --planes 20 -o profiles.csv\n"
        "  taihu section rock.vdb --holes holes.csv --base base.vdb -o profiles.csv\n"
        "  taihu section rock.vdb --base base.vdb --direction 0,1,0 --planes 5 -o profiles.csv\n"
        "  taihu section rock.vdb --planes 3 --photos photos --tilt 25deg --scale-bar 20cm");
    verb->add_option("solid", args->solid.path, "Solid with holes (.vdb or a mesh)")->required();
    verb->add_option("-o,--output", args->out,
                     "Table to write, which fit reads: plane,u_m,v_m,diameter_m (.csv)");
    verb->add_option("--planes", args->settings.n_planes, "How many, 1..10000")
        ->check(CLI::Range(1, 10'000))
        ->capture_default_str();
    verb->add_option("--direction", args->direction,
                     "Normal X,Y,Z of parallel planes [random planes]")
        ->delimiter(',')
        ->expected(3);
    verb->add_option("--seed", args->settings.seed, "Of the planes")->capture_default_str();
    auto* holes = verb->add_option("--holes", args->holes,
                                   "The holes there are (.csv): exact circles, hidden ones too");
    verb->add_option("--base", args->base, "The solid before it was carved [the filled outline]");
    verb->add_flag("--major", args->major, "Diameters are major axes, not those of equal area")
        ->excludes(holes);
    args->solid.add_voxel_options(*verb);
    add_photo_options(*verb, args->photos);
    verb->callback([args, &console] { console.within_limits([&] { run(*args, console); }); });
}

} // namespace taihu
