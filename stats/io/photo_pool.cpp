#include "stats/io/photo_pool_detail.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "stats/core/error.h"
#include "stats/core/file.h"
#include "stats/core/text.h"
#include "stats/io/photo_mask_detail.h"
#include "stats/number_detail.h"

namespace taihu {
namespace {

[[noreturn]] void refuse(const std::string& where, const std::string& what) {
    throw Error(Fault::bad_input, where + ": " + what);
}

std::string count(std::size_t n, const char* one) {
    return std::to_string(n) + " " + one + (n == 1 ? "" : "s");
}

bool is_scale_bar(const Mark& mark) {
    static constexpr std::string_view kScale = "scale";
    return std::equal(mark.label.begin(), mark.label.end(), kScale.begin(), kScale.end(),
                      [](char a, char b) { return (a >= 'A' && a <= 'Z' ? a + 32 : a) == b; });
}

double length_px(const Mark& mark) {
    return mark.length_px.value_or(std::hypot(mark.x2 - mark.x1, mark.y2 - mark.y1));
}

/// A photo of any number of files, as it is put together.
struct PooledPhoto {
    Photo photo;
    std::optional<Image> mask;
    bool perhaps_calibrated = false;
    std::vector<double> bars_px;
    std::size_t n_holes = 0, n_in_the_dark = 0;
    bool has_rows = false, has_scale = false;
};

class Pool {
public:
    Pool(std::span<const Annotations> files, const MeasurementSettings& settings,
         std::vector<std::string>& warnings)
        : files_(files), settings_(settings), warnings_(warnings) {}

    PhotoPool run() {
        join_photos();
        for (const PhotoMask& mask : settings_.masks)
            add_mask(mask);
        for (std::size_t f = 0; f < files_.size(); ++f)
            for (const Mark& mark : files_[f].marks)
                sort_mark(f, mark);
        tell_what_is_left_out();
        for (PooledPhoto& p : photos_)
            find_bar_scale(p);
        for (const Hole& hole : holes_)
            find_row_scale(hole);
        check_scales();
        warn_of_duplicates();
        return result();
    }

private:
    struct Hole {
        std::size_t file, photo;
        const Mark* mark;
    };

    void join_photos();
    void add_mask(const PhotoMask& mask);
    void check_mark(const Annotations& file, const Mark& mark, const Photo& photo) const;
    void sort_mark(std::size_t f, const Mark& mark);
    void tell_what_is_left_out();
    void find_bar_scale(PooledPhoto& p);
    void find_row_scale(const Hole& hole);
    void check_scales() const;
    LengthUnit unit_of(std::size_t f, bool scaled) const;
    void warn_of_duplicates();
    PhotoPool result();

    std::span<const Annotations> files_;
    const MeasurementSettings& settings_;
    std::vector<std::string>& warnings_;
    std::vector<PooledPhoto> photos_;
    std::vector<std::vector<std::size_t>> pooled_; ///< index into photos_, by file and its photo
    std::vector<Hole> holes_;
    std::map<std::string, std::size_t> other_labels_;
    std::size_t n_unused_bars_ = 0;
};

void Pool::join_photos() {
    Annotations all; // knows how to join by name, and that a photo has one size
    for (const Annotations& file : files_) {
        all.file = file.file;
        pooled_.emplace_back();
        for (const MarkedPhoto& p : file.photos) {
            std::size_t i = photos_.size();
            if (p.name)
                i = all.photo(p.name);
            else
                all.photos.push_back(p);
            pooled_.back().push_back(i);
            if (p.name)
                all.set_size(i, p.width_px, p.height_px);
            if (i == photos_.size()) {
                photos_.emplace_back();
                photos_[i].photo.name = p.name.value_or(file.file);
            }
            photos_[i].photo.width_px = all.photos[i].width_px;
            photos_[i].photo.height_px = all.photos[i].height_px;
            photos_[i].perhaps_calibrated |= file.perhaps_calibrated;
        }
    }
}

/// Is `mask` named after `photo`: plane-1-mask.png after plane-1.jpg, and not after plane-10.jpg?
bool named_after(const std::filesystem::path& mask, const std::string& photo) {
    const std::string of = std::filesystem::path(last_part(photo)).stem().string();
    const std::string name = mask.stem().string();
    return !of.empty() && name.starts_with(of) &&
           (name.size() == of.size() || !std::isalnum(static_cast<unsigned char>(name[of.size()])));
}

void Pool::add_mask(const PhotoMask& mask) {
    const std::string name = base_name(mask.file);
    const bool any_named = std::any_of(photos_.begin(), photos_.end(), [&](const PooledPhoto& p) {
        return named_after(mask.file, p.photo.name);
    });
    const auto refuse_mask = [&](const std::string& what) {
        throw Error(Fault::bad_argument, "mask '" + name + "': " + what);
    };
    PooledPhoto* found = nullptr;
    for (PooledPhoto& p : photos_) {
        const bool is_it = mask.photo.empty() ? !any_named || named_after(mask.file, p.photo.name)
                                              : p.photo.name == mask.photo ||
                                                    last_part(p.photo.name) == mask.photo;
        if (is_it && found)
            refuse_mask("both '" + printable(found->photo.name) + "' and '" +
                        printable(p.photo.name) + "' could be its photo; name one of them");
        if (is_it)
            found = &p;
    }
    if (!found)
        refuse_mask("there is no photo '" + printable(mask.photo) + "'; name one of the files");
    if (found->mask)
        refuse_mask("'" + printable(found->photo.name) + "' has another one; keep one of them");
    if (found->perhaps_calibrated)
        refuse_mask("in a table of ImageJ's results places may not be in pixels; mark the photo "
                    "in another format");
    Image image = read_photo_mask(mask.file);
    Photo& photo = found->photo;
    if (photo.width_px != 0 && (photo.width_px != image.width || photo.height_px != image.height))
        refuse(name, std::to_string(image.width) + " x " + std::to_string(image.height) +
                         " pixels, its photo '" + printable(photo.name) + "' has " +
                         std::to_string(photo.width_px) + " x " + std::to_string(photo.height_px) +
                         "; draw the mask on the photo");
    photo.width_px = image.width;
    photo.height_px = image.height;
    found->mask = std::move(image);
}

void Pool::check_mark(const Annotations& file, const Mark& mark, const Photo& photo) const {
    const double length = length_px(mark);
    if (!(length > 0 && std::isfinite(length)))
        refuse(place_of(file, mark),
               "the segment has length " + shortest(length) + "; drop the row or fix its ends");
    if (!mark.has_ends || photo.width_px == 0)
        return;
    const auto check = [&](const char* name, double value, int side) {
        // Programs differ by half a pixel in where a pixel lies, and round.
        if (!(value >= -1 && value <= side + 1.0))
            refuse(place_of(file, mark),
                   std::string(name) + " is " + shortest(value) + ", outside of the image of " +
                       std::to_string(photo.width_px) + " x " + std::to_string(photo.height_px) +
                       " px; are x and y swapped, or was the photo resized");
    };
    check("x1", mark.x1, photo.width_px);
    check("y1", mark.y1, photo.height_px);
    check("x2", mark.x2, photo.width_px);
    check("y2", mark.y2, photo.height_px);
}

void Pool::sort_mark(std::size_t f, const Mark& mark) {
    const std::size_t photo = pooled_[f][mark.photo];
    PooledPhoto& p = photos_[photo];
    check_mark(files_[f], mark, p.photo);
    if (is_scale_bar(mark)) {
        if (settings_.scale_bar_m)
            p.bars_px.push_back(length_px(mark));
        else
            ++n_unused_bars_;
        return;
    }
    if (settings_.label && mark.label != *settings_.label) {
        ++other_labels_[mark.label];
        return;
    }
    if (p.mask) {
        const auto pixel = [](double a, double b, int side) {
            return std::clamp(static_cast<int>(std::floor((a + b) / 2)), 0, side - 1);
        };
        if (*p.mask->at(pixel(mark.x1, mark.x2, p.mask->width),
                        pixel(mark.y1, mark.y2, p.mask->height)) < 0.5f) {
            ++p.n_in_the_dark;
            return;
        }
    }
    ++p.n_holes;
    holes_.push_back({f, photo, &mark});
}

void Pool::tell_what_is_left_out() {
    static constexpr std::size_t kMostLabels = 8; // named; a file may have one a segment
    for (const Annotations& file : files_) {
        std::string shapes;
        for (const auto& [kind, n] : file.other_shapes)
            shapes += (shapes.empty() ? "" : ", ") + std::to_string(n) + " x " + kind;
        if (!shapes.empty())
            warnings_.push_back(file.file + ": no segments and left out: " + shapes);
    }
    if (n_unused_bars_ > 0)
        warnings_.push_back(count(n_unused_bars_, "segment") +
                            " labelled 'scale' left out; the length of the bar is not said");
    std::size_t n_told = 0, n_more = 0;
    std::vector<std::string_view> labels;
    for (const auto& [label, n] : other_labels_) {
        labels.push_back(label);
        if (n_told++ < kMostLabels)
            warnings_.push_back(count(n, "segment") + " labelled '" + printable(label) +
                                "' left out");
        else
            n_more += n;
    }
    if (n_more > 0)
        warnings_.push_back(count(n_more, "segment") + " with still other labels left out");
    if (settings_.label && holes_.empty()) {
        labels.resize(std::min(labels.size(), std::size_t{1000}));
        throw Error(Fault::bad_argument, "label: no segment is labelled '" +
                                             printable(*settings_.label) + "'" +
                                             did_you_mean(*settings_.label, labels));
    }
    for (const PooledPhoto& p : photos_) {
        if (p.n_in_the_dark > 0)
            warnings_.push_back(printable(p.photo.name) + ": " + count(p.n_in_the_dark, "segment") +
                                " outside of the mask left out");
        if (p.n_holes == 0)
            warnings_.push_back(printable(p.photo.name) +
                                ": no holes are marked; the photo does not count as searched");
    }
}

void Pool::find_bar_scale(PooledPhoto& p) {
    if (p.bars_px.empty())
        return;
    static constexpr double kDiffer = 0.02; // a volume is then off by 6 %
    double sum = 0;
    for (const double bar : p.bars_px)
        sum += bar;
    const auto [least, greatest] = std::minmax_element(p.bars_px.begin(), p.bars_px.end());
    if (*greatest > *least * (1 + kDiffer))
        warnings_.push_back(printable(p.photo.name) + ": its scale bars are " + shortest(*least) +
                            " to " + shortest(*greatest) + " px long; their mean is used");
    p.photo.unit_per_px = *settings_.scale_bar_m * static_cast<double>(p.bars_px.size()) / sum;
    p.has_scale = true;
    if (!(p.photo.unit_per_px > 0 && std::isfinite(p.photo.unit_per_px)))
        refuse(printable(p.photo.name), "its scale bar gives a pixel of " +
                                            shortest(p.photo.unit_per_px) + " m; mark it again");
}

// The scale by the row, or by the setting where the row has none; by all rows the same.
void Pool::find_row_scale(const Hole& hole) {
    PooledPhoto& p = photos_[hole.photo];
    const Annotations& file = files_[hole.file];
    const std::string where = place_of(file, *hole.mark);
    const auto& own = hole.mark->unit_per_px;
    if (!p.bars_px.empty()) {
        if (own.value_or(1) != 1)
            refuse(where, "the image has a scale bar and a unit_per_px of " + shortest(*own) +
                              "; keep one of them");
        return;
    }
    std::optional<double> scale = own ? own : settings_.unit_per_px;
    if (!scale && file.perhaps_calibrated && settings_.unit == LengthUnit::metre)
        scale = 1; // the caller says that ImageJ's lengths are metres
    if (!p.has_rows) {
        p.has_rows = true;
        p.has_scale = scale.has_value();
        p.photo.unit_per_px = scale.value_or(1);
    } else if (p.has_scale != scale.has_value()) {
        refuse(where, "some rows have a scale and some have none; fill in all");
    } else if (p.photo.unit_per_px != scale.value_or(1)) {
        refuse(where, "unit_per_px is " + shortest(*scale) + " but " +
                          shortest(p.photo.unit_per_px) +
                          " on the same image before; an image has one scale");
    }
}

void Pool::check_scales() const {
    const PooledPhoto *scaled = nullptr, *unscaled = nullptr;
    bool has_bars = false;
    for (const PooledPhoto& p : photos_) {
        has_bars = has_bars || !p.bars_px.empty();
        if (p.n_holes > 0)
            (p.has_scale ? scaled : unscaled) = &p;
    }
    if (settings_.scale_bar_m && !has_bars)
        throw Error(Fault::bad_argument, "scale bar: no segment is labelled 'scale'; mark the bar "
                                         "on the photo, or give the length of a pixel");
    if (scaled && unscaled)
        refuse(printable(unscaled->photo.name),
               "the photo has no scale but '" + printable(scaled->photo.name) +
                   "' has one; mark its scale bar or give its unit_per_px");
}

// `scaled`: something in the file has a scale other than 1.
LengthUnit Pool::unit_of(std::size_t f, bool scaled) const {
    const Annotations& file = files_[f];
    bool has_bar = false, all_known = true;
    for (const std::size_t i : pooled_[f]) {
        has_bar = has_bar || !photos_[i].bars_px.empty();
        all_known = all_known && (photos_[i].has_scale || photos_[i].n_holes == 0);
    }
    if (has_bar && file.unit == LengthUnit::pixel)
        refuse(file.file, "unit is px but there is a scale bar; leave one of them out");
    if (file.unit == LengthUnit::metre && !all_known)
        refuse(file.file, "unit is m but unit_per_px is empty; give the metres of a pixel");
    if (!file.unit && !has_bar && scaled)
        refuse(file.file, "the unit of the lengths is not said; add a line '# unit=m', "
                          "'# unit=px' or '# unit=greatest', or say it beside the scale");
    return file.unit.value_or(has_bar ? LengthUnit::metre : LengthUnit::pixel);
}

void Pool::warn_of_duplicates() {
    using Point = std::pair<double, double>;
    std::vector<std::tuple<std::size_t, Point, Point, std::size_t>> keys;
    for (std::size_t i = 0; i < holes_.size(); ++i) {
        const Mark& m = *holes_[i].mark;
        const Point a{m.x1, m.y1}, b{m.x2, m.y2};
        if (m.has_ends)
            keys.emplace_back(holes_[i].photo, std::min(a, b), std::max(a, b), i);
    }
    std::sort(keys.begin(), keys.end());
    for (std::size_t i = 1; i < keys.size(); ++i) {
        const auto& [photo, a, b, at] = keys[i];
        if (std::tie(photo, a, b) !=
            std::tie(std::get<0>(keys[i - 1]), std::get<1>(keys[i - 1]), std::get<2>(keys[i - 1])))
            continue;
        const Hole &before = holes_[std::get<3>(keys[i - 1])], &again = holes_[at];
        const Annotations& file = files_[again.file];
        const std::string same =
            before.file != again.file ? "in " + place_of(files_[before.file], *before.mark)
            : before.mark->line > 0   ? "on line " + std::to_string(before.mark->line)
                                      : before.mark->item;
        warnings_.push_back(place_of(file, *again.mark) + ": the same segment as " + same +
                            "; it is counted twice");
    }
}

PhotoPool Pool::result() {
    PhotoPool pool;
    std::vector<std::size_t> place(photos_.size());
    std::size_t n_unscaled = 0;
    for (std::size_t i = 0; i < photos_.size(); ++i) {
        place[i] = pool.photos.size();
        if (photos_[i].n_holes == 0)
            continue;
        n_unscaled += photos_[i].has_scale ? 0 : 1;
        pool.photos.push_back(photos_[i].photo);
        pool.masks.push_back(std::move(photos_[i].mask));
    }
    if (n_unscaled > 1)
        warnings_.push_back("pixels of " + std::to_string(n_unscaled) +
                            " photos are pooled as if they were equal; give each its scale");
    std::vector<bool> scaled(files_.size());
    for (const Hole& hole : holes_) {
        const Mark& m = *hole.mark;
        const Photo& photo = photos_[hole.photo].photo;
        scaled[hole.file] = scaled[hole.file] || photo.unit_per_px != 1;
        const double diameter = length_px(m) * photo.unit_per_px;
        if (!(diameter > 0 && std::isfinite(diameter)))
            refuse(place_of(files_[hole.file], m),
                   "the diameter is " + shortest(diameter) + "; correct the scale");
        pool.segments.push_back({photo.name, m.label, m.x1, m.y1, m.x2, m.y2, diameter, m.minor_px,
                                 m.line, place[hole.photo], m.has_ends});
    }
    for (std::size_t f = 0; f < files_.size(); ++f) {
        pool.units.push_back(unit_of(f, scaled[f]));
        if (files_[f].perhaps_calibrated && !settings_.unit && !settings_.unit_per_px &&
            !settings_.scale_bar_m)
            warnings_.push_back(files_[f].file + ": lengths are read as pixels; if ImageJ was told "
                                                 "a scale, say the unit it was in");
    }
    return pool;
}

} // namespace

PhotoPool pool_photos(std::span<const Annotations> files, const MeasurementSettings& settings,
                      std::vector<std::string>& warnings) {
    return Pool(files, settings, warnings).run();
}

} // namespace taihu
