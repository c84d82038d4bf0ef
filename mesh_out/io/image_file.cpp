#include "mesh_out/io/image_file.h"

#include <array>
#include <cmath>
#include <csetjmp>
#include <cstdint>
#include <cstring>
#include <exception>

#include <png.h>

#include "mesh_out/io/exr_file.h"
#include "stats/core/error.h"
#include "stats/core/file.h"

namespace taihu {
namespace {

constexpr std::size_t kMaxPixels = std::size_t{1} << 28;
constexpr double kSrgbGamma = 0.45455; // what gAMA says of a file whose curve is that of sRGB
constexpr std::size_t kMaxDeflateRatio = 1032; // no deflate stream unpacks to more

// The curve of IEC 61966-2-1, from 0..1 to 0..1 either way.
double encoded(double linear) {
    return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}
double decoded(double value) {
    return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

bool has_alpha(int channels) {
    return channels == 2 || channels == 4;
}

// libpng leaves by longjmp: whatever it may jump over lives in one of these, outside the function
// that calls setjmp, and those functions hold plain values only.
struct PngState {
    png_structp png = nullptr;
    png_infop info = nullptr;
    std::array<char, 160> message{};
};

[[noreturn]] void on_error(png_structp png, png_const_charp text) {
    auto& state = *static_cast<PngState*>(png_get_error_ptr(png));
    std::strncpy(state.message.data(), text, state.message.size() - 1);
    png_longjmp(png, 1);
}
void on_warning(png_structp, png_const_charp) {}

struct PngWriter : PngState {
    std::string bytes;

    PngWriter() {
        png = png_create_write_struct(PNG_LIBPNG_VER_STRING, static_cast<PngState*>(this), on_error,
                                      on_warning);
        info = png ? png_create_info_struct(png) : nullptr;
    }
    PngWriter(const PngWriter&) = delete;
    PngWriter& operator=(const PngWriter&) = delete;
    ~PngWriter() { png_destroy_write_struct(&png, &info); }

    static void append(png_structp p, png_bytep data, std::size_t size) {
        bool fits = true;
        try {
            static_cast<PngWriter*>(png_get_io_ptr(p))
                ->bytes.append(reinterpret_cast<const char*>(data), size);
        } catch (const std::exception&) {
            fits = false; // an exception must not pass through C, nor a jump leave a handler
        }
        if (!fits)
            png_error(p, "out of memory");
    }
    static void flush(png_structp) {}
};

struct PngReader : PngState {
    std::string_view rest;

    explicit PngReader(std::string_view bytes) : rest(bytes) {
        png = png_create_read_struct(PNG_LIBPNG_VER_STRING, static_cast<PngState*>(this), on_error,
                                     on_warning);
        info = png ? png_create_info_struct(png) : nullptr;
    }
    PngReader(const PngReader&) = delete;
    PngReader& operator=(const PngReader&) = delete;
    ~PngReader() { png_destroy_read_struct(&png, &info, nullptr); }

    static void take(png_structp p, png_bytep data, std::size_t size) {
        auto& reader = *static_cast<PngReader*>(png_get_io_ptr(p));
        if (size > reader.rest.size())
            png_error(p, "the file is cut short");
        std::memcpy(data, reader.rest.data(), size);
        reader.rest.remove_prefix(size);
    }
};

bool write_png(PngWriter& w, const Image& image, PngValues values, png_bytep* rows, png_textp texts,
               int n_texts) {
    if (!w.info || setjmp(png_jmpbuf(w.png)))
        return false;
    png_set_write_fn(w.png, &w, PngWriter::append, PngWriter::flush);
    const int type = image.channels == 1   ? PNG_COLOR_TYPE_GRAY
                     : image.channels == 3 ? PNG_COLOR_TYPE_RGB
                                           : PNG_COLOR_TYPE_RGB_ALPHA;
    png_set_IHDR(w.png, w.info, static_cast<png_uint_32>(image.width),
                 static_cast<png_uint_32>(image.height), 8, type, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    if (values == PngValues::light)
        png_set_sRGB(w.png, w.info, PNG_sRGB_INTENT_PERCEPTUAL);
    if (n_texts > 0)
        png_set_text(w.png, w.info, texts, n_texts);
    png_write_info(w.png, w.info);
    png_write_image(w.png, rows);
    png_write_end(w.png, w.info);
    return true;
}

using Attributes = std::vector<std::pair<std::string, std::string>>;

void check_image(const std::string& where, const Image& image) {
    if (image.channels != 1 && image.channels != 3 && image.channels != 4)
        throw Error(Fault::bad_argument, where + ": the image has " +
                                             std::to_string(image.channels) +
                                             " channels; give 1, 3 or 4");
    if (image.width <= 0 || image.height <= 0 ||
        image.pixels.size() / static_cast<std::size_t>(image.channels) /
                static_cast<std::size_t>(image.width) !=
            static_cast<std::size_t>(image.height) ||
        image.pixels.size() % static_cast<std::size_t>(image.channels * image.width) != 0)
        throw Error(Fault::bad_argument,
                    where + ": " + std::to_string(image.pixels.size()) +
                        " numbers are no image of " + std::to_string(image.width) + " x " +
                        std::to_string(image.height) + " pixels; give width * height * channels");
}

std::string png_bytes(const std::string& where, const Image& image, PngValues values,
                      const Attributes& attributes) {
    std::vector<png_byte> samples(image.pixels.size());
    for (std::size_t i = 0; i < samples.size(); ++i) {
        const auto channel = static_cast<int>(i % static_cast<std::size_t>(image.channels));
        const bool is_alpha = has_alpha(image.channels) && channel == image.channels - 1;
        const double value = image.pixels[i] > 0 ? std::min(1.0, double{image.pixels[i]}) : 0;
        const bool is_stored = is_alpha || values == PngValues::data;
        samples[i] = static_cast<png_byte>(255 * (is_stored ? value : encoded(value)) + 0.5);
    }
    std::vector<png_bytep> rows;
    const std::size_t row_bytes = samples.size() / static_cast<std::size_t>(image.height);
    for (std::size_t y = 0; y < static_cast<std::size_t>(image.height); ++y)
        rows.push_back(samples.data() + y * row_bytes);
    std::vector<png_text> texts;
    for (const auto& [key, value] : attributes) {
        if (key.empty() || key.size() > 79)
            throw Error(Fault::bad_argument,
                        where + ": attribute '" + key +
                            "': a PNG takes names of 1 to 79 characters; rename it");
        png_text text{};
        text.compression = PNG_TEXT_COMPRESSION_NONE;
        text.key = const_cast<char*>(key.c_str()); // libpng copies both, and changes neither
        text.text = const_cast<char*>(value.c_str());
        text.text_length = value.size();
        texts.push_back(text);
    }
    PngWriter writer;
    if (!write_png(writer, image, values, rows.data(), texts.data(),
                   static_cast<int>(texts.size())))
        throw Error(Fault::io, where + ": cannot encode: " + writer.message.data());
    return std::move(writer.bytes);
}

struct PngShape {
    std::size_t width = 0, height = 0;
    std::size_t stored_row_bits = 0;
    double exponent = 0; ///< from stored to linear values; 0 is the curve of sRGB
    // Once palette, small grey depths and transparency are expanded:
    std::size_t channels = 0, bytes_per_sample = 0, row_bytes = 0;
};

bool read_header(PngReader& r, PngShape& shape) {
    if (!r.info || setjmp(png_jmpbuf(r.png)))
        return false;
    png_set_read_fn(r.png, &r, PngReader::take);
    png_set_user_limits(r.png, 0x7fffffff, 0x7fffffff); // pixels are limited below
    png_read_info(r.png, r.info);
    shape.width = png_get_image_width(r.png, r.info);
    shape.height = png_get_image_height(r.png, r.info);
    shape.stored_row_bits =
        shape.width * png_get_bit_depth(r.png, r.info) * png_get_channels(r.png, r.info);
    double gamma = 0;
    if (png_get_gAMA(r.png, r.info, &gamma) && std::abs(gamma - kSrgbGamma) > 0.01)
        shape.exponent = 1 / gamma;
    return true;
}

/// Allocates some rows: only for a header that was found plausible.
bool start_rows(PngReader& r, PngShape& shape) {
    if (setjmp(png_jmpbuf(r.png)))
        return false;
    png_set_expand(r.png);
    png_set_interlace_handling(r.png);
    png_read_update_info(r.png, r.info);
    shape.channels = png_get_channels(r.png, r.info);
    shape.bytes_per_sample = png_get_bit_depth(r.png, r.info) / 8u;
    shape.row_bytes = png_get_rowbytes(r.png, r.info);
    return true;
}

bool read_rows(PngReader& r, png_bytep* rows) {
    if (setjmp(png_jmpbuf(r.png)))
        return false;
    png_read_image(r.png, rows);
    png_read_end(r.png, nullptr);
    return true;
}

Image image_of(const PngShape& shape, const std::vector<png_byte>& samples, PngValues values) {
    Image image(static_cast<int>(shape.width), static_cast<int>(shape.height),
                static_cast<int>(shape.channels));
    const std::size_t n_levels = shape.bytes_per_sample == 2 ? 65536 : 256;
    std::vector<float> curve(n_levels), straight(n_levels);
    for (std::size_t i = 0; i < n_levels; ++i) {
        const double value = static_cast<double>(i) / static_cast<double>(n_levels - 1);
        curve[i] = static_cast<float>(shape.exponent > 0 ? std::pow(value, shape.exponent)
                                                         : decoded(value));
        straight[i] = static_cast<float>(value);
    }
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        const std::size_t level =
            shape.bytes_per_sample == 2 ? samples[2 * i] * 256u + samples[2 * i + 1] : samples[i];
        const bool is_alpha = has_alpha(image.channels) && (i + 1) % shape.channels == 0;
        image.pixels[i] = (is_alpha || values == PngValues::data ? straight : curve)[level];
    }
    return image;
}

} // namespace

std::string format_png(const Image& image, PngValues values, const std::string& where,
                       const std::vector<std::pair<std::string, std::string>>& attributes) {
    check_image(where, image);
    return png_bytes(where, image, values, attributes);
}

void write_image(const std::filesystem::path& path, const Image& image,
                 const std::vector<std::pair<std::string, std::string>>& attributes) {
    const std::string extension = path.extension().string();
    if (extension != ".png" && extension != ".exr")
        throw Error(Fault::unsupported, base_name(path) +
                                            ": images are written as .png or .exr, not '" +
                                            extension + "'; choose one of these");
    if (extension == ".png")
        return write_file(path, format_png(image, PngValues::light, base_name(path), attributes));
    check_image(base_name(path), image);
    std::vector<std::string> channels = {"Y"};
    if (image.channels > 1)
        channels.assign({"R", "G", "B", "A"});
    channels.resize(static_cast<std::size_t>(image.channels));
    write_exr(path, {image, channels, attributes});
}

Image read_png(const std::filesystem::path& path, PngValues values) {
    const std::string bytes = read_file(path);
    const auto refuse = [&](const std::string& what, const char* remedy) -> Error {
        return Error(Fault::bad_input, base_name(path) + ": " + what + "; " + remedy);
    };
    PngReader reader(bytes);
    PngShape shape;
    if (!read_header(reader, shape))
        throw refuse(std::string("not a PNG that can be read: ") + reader.message.data(),
                     "save it again as PNG");
    const std::string size =
        std::to_string(shape.width) + " x " + std::to_string(shape.height) + " pixels";
    if (shape.height > kMaxPixels / shape.width)
        throw refuse(size + ", at most 2^28 are read", "reduce the image");
    if (shape.stored_row_bits / 8 * shape.height > kMaxDeflateRatio * bytes.size())
        throw refuse(size + " cannot come out of " + std::to_string(bytes.size()) + " bytes",
                     "the file is cut short or forged");
    const auto damaged = [&] {
        return refuse(std::string("damaged PNG: ") + reader.message.data(), "save it again as PNG");
    };
    if (!start_rows(reader, shape))
        throw damaged();
    std::vector<png_byte> samples(shape.row_bytes * shape.height);
    std::vector<png_bytep> rows(shape.height);
    for (std::size_t y = 0; y < shape.height; ++y)
        rows[y] = samples.data() + y * shape.row_bytes;
    if (!read_rows(reader, rows.data()))
        throw damaged();
    return image_of(shape, samples, values);
}

} // namespace taihu
