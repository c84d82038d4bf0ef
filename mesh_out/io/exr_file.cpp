#include "mesh_out/io/exr_file.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <exception>

#include <Iex.h>
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <ImfStringAttribute.h>
#include <half.h>

#include "mesh_out/io/foreign_formats_detail.h"
#include "stats/core/error.h"
#include "stats/core/file.h"
#include "stats/core/flat.h"
#include "stats/core/foreign.h"
#include "stats/core/text.h"

namespace taihu {
namespace {

constexpr std::size_t kMaxSamples = std::size_t{1} << 28;
constexpr std::size_t kMaxDeflateRatio = 1032; // no deflate stream unpacks to more; the others pack
                                               // less than that, but for DWA
constexpr std::uint32_t kTiled = 0x200, kLongNames = 0x400, kDeep = 0x800, kParts = 0x1000;

/// A file of OpenEXR in memory: it seeks back to fill in where its lines begin.
class StringOutput : public Imf::OStream {
public:
    StringOutput() : Imf::OStream("memory") {}

    void write(const char data[], int size) override {
        const auto n = static_cast<std::size_t>(size);
        if (bytes.size() < position_ + n)
            bytes.resize(position_ + n);
        bytes.replace(position_, n, data, n);
        position_ += n;
    }
    std::uint64_t tellp() override { return position_; }
    void seekp(std::uint64_t position) override { position_ = position; }

    std::string bytes;

private:
    std::size_t position_ = 0;
};

class StringInput : public Imf::IStream {
public:
    explicit StringInput(std::string_view bytes) : Imf::IStream("memory"), bytes_(bytes) {}

    bool read(char data[], int size) override {
        const auto n = static_cast<std::size_t>(size);
        if (size < 0 || position_ > bytes_.size() || n > bytes_.size() - position_)
            throw Iex::InputExc("the file is cut short");
        std::memcpy(data, bytes_.data() + position_, n);
        position_ += n;
        return position_ < bytes_.size();
    }
    std::uint64_t tellg() override { return position_; }
    void seekg(std::uint64_t position) override { position_ = position; }

private:
    std::string_view bytes_;
    std::size_t position_ = 0;
};

/// Walks over the header before OpenEXR does, which allocates what any attribute asks for.
class HeaderWalk {
public:
    HeaderWalk(std::string_view bytes, std::string name) : bytes_(bytes), name_(std::move(name)) {}

    void check() {
        if (bytes_.substr(0, 4) != "\x76\x2f\x31\x01")
            throw bad("not an EXR", "give a file that begins like one");
        at_ = 4;
        const std::uint32_t version = word();
        if (version & (kDeep | kParts))
            throw Error(Fault::unsupported, name_ + ": has " +
                                                (version & kParts ? "several parts" : "deep data") +
                                                "; save it as one flat picture");
        if ((version & 0xff) > 2 || version & ~(0xffu | kTiled | kLongNames))
            throw Error(Fault::unsupported,
                        name_ + ": is of an unknown version; save it as OpenEXR 2");
        while (!text().empty()) {
            const std::string_view type = text();
            const std::size_t size = word();
            if (size > bytes_.size() - at_)
                throw cut_short();
            if (type == "preview")
                check_preview(size);
            at_ += size;
        }
    }

private:
    Error bad(const std::string& what, const char* remedy) const {
        return Error(Fault::bad_input, name_ + ": " + what + "; " + remedy);
    }
    Error cut_short() const {
        return bad("the header is cut short or damaged", "save it again as EXR");
    }
    std::uint32_t word() {
        if (bytes_.size() - at_ < 4)
            throw cut_short();
        std::uint32_t value = 0;
        for (std::size_t i = 4; i-- > 0;)
            value = value << 8 | static_cast<unsigned char>(bytes_[at_ + i]);
        at_ += 4;
        return value;
    }
    std::string_view text() {
        const std::size_t end = bytes_.find('\0', at_);
        if (end == std::string_view::npos || end - at_ > 255)
            throw cut_short();
        const std::string_view out = bytes_.substr(at_, end - at_);
        at_ = end + 1;
        return out;
    }
    void check_preview(std::size_t size) {
        const std::size_t start = at_;
        const std::uint64_t width = word(), height = word();
        if (width > 65536 || height > 65536 || size < 8 + 4 * width * height)
            throw cut_short();
        at_ = start;
    }

    std::string_view bytes_;
    std::string name_;
    std::size_t at_ = 0;
};

std::string joined(std::span<const std::string_view> names) {
    std::string out;
    for (const std::string_view n : names)
        out += (out.empty() ? "" : ", ") + printable(n);
    return out;
}

/// The channels to read: those asked for, or all. None is subsampled.
std::vector<std::string> chosen(const Imf::ChannelList& list, std::span<const std::string> asked,
                                const std::string& name) {
    std::vector<std::string> out(asked.begin(), asked.end());
    std::vector<std::string_view> known;
    for (auto it = list.begin(); it != list.end(); ++it)
        known.push_back(it.name());
    if (out.empty())
        out.assign(known.begin(), known.end());
    for (const std::string& c : out) {
        const Imf::Channel* channel = list.findChannel(c);
        if (!channel)
            throw Error(Fault::bad_input,
                        name + ": has no channel '" + printable(c) + "'; it has " + joined(known));
        if (channel->xSampling != 1 || channel->ySampling != 1)
            throw Error(Fault::unsupported, name + ": channel '" + printable(c) +
                                                "' is subsampled; save it at full size");
    }
    return out;
}

/// \param pixels  as those of an image of this width, each sample a Sample.
template <class Sample>
Imf::FrameBuffer frame_of(std::vector<Sample>& pixels, int width,
                          std::span<const std::string> channels, Imath::V2i origin) {
    const std::size_t pixel = sizeof(Sample) * channels.size();
    const std::size_t row = pixel * static_cast<std::size_t>(width);
    // OpenEXR adds the coordinates of a pixel to the base: in integers, for it may point nowhere.
    const auto base = reinterpret_cast<std::uintptr_t>(pixels.data()) -
                      static_cast<std::uintptr_t>(static_cast<std::intptr_t>(origin.x)) * pixel -
                      static_cast<std::uintptr_t>(static_cast<std::intptr_t>(origin.y)) * row;
    Imf::FrameBuffer frame;
    for (std::size_t c = 0; c < channels.size(); ++c)
        frame.insert(channels[c],
                     Imf::Slice(std::is_same_v<Sample, half> ? Imf::HALF : Imf::FLOAT,
                                reinterpret_cast<char*>(base + c * sizeof(Sample)), pixel, row));
    return frame;
}

std::vector<half> to_halves(const Image& image, const std::string& name) {
    std::vector<half> out;
    out.reserve(image.pixels.size());
    for (const float value : image.pixels) {
        out.emplace_back(value);
        if (!out.back().isFinite())
            throw Error(Fault::bad_argument, name + ": " + std::to_string(value) +
                                                 " is beyond what a half holds; write it as float");
    }
    return out;
}

/// The size that a header gives, once it is one that the file can hold.
Image empty_image(const Imf::Header& header, std::size_t n_channels, std::size_t n_bytes,
                  const std::string& name) {
    const Imath::Box2i window = header.dataWindow();
    const std::int64_t width = std::int64_t{window.max.x} - window.min.x + 1,
                       height = std::int64_t{window.max.y} - window.min.y + 1;
    const std::string size = std::to_string(width) + " x " + std::to_string(height) +
                             " pixels of " + std::to_string(n_channels) + " channels";
    if (width < 1 || height < 1 || n_channels < 1)
        throw Error(Fault::bad_input, name + ": " + size + " are no picture; save it again");
    if (height > static_cast<std::int64_t>(kMaxSamples) / width ||
        n_channels > kMaxSamples / static_cast<std::size_t>(width * height))
        throw Error(Fault::bad_input,
                    name + ": " + size + ", at most 2^28 samples are read; reduce it");
    const auto n_samples = static_cast<std::size_t>(width * height) * n_channels;
    if (2 * n_samples / kMaxDeflateRatio > n_bytes) // half floats have two bytes
        throw Error(Fault::bad_input, name + ": " + size + " cannot come out of " +
                                          std::to_string(n_bytes) +
                                          " bytes; the file is cut short or forged");
    return {static_cast<int>(width), static_cast<int>(height), static_cast<int>(n_channels)};
}

} // namespace

void write_exr(const std::filesystem::path& path, const ExrImage& exr, ExrSamples samples) {
    const Image& image = exr.image;
    std::vector<std::string> sorted = exr.channels;
    std::sort(sorted.begin(), sorted.end());
    if (image.width < 1 || image.height < 1 || image.channels < 1 ||
        sorted.size() != static_cast<std::size_t>(image.channels) || sorted.front().empty() ||
        std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end() ||
        image.pixels.size() != static_cast<std::size_t>(image.width) *
                                   static_cast<std::size_t>(image.height) * sorted.size())
        throw Error(Fault::bad_argument,
                    base_name(path) + ": " + std::to_string(image.width) + " x " +
                        std::to_string(image.height) + " pixels with " +
                        std::to_string(sorted.size()) + " names of channels and " +
                        std::to_string(image.pixels.size()) +
                        " numbers are no picture; give each channel a name of its own");
    StringOutput stream;
    try {
        Imf::Header header(image.width, image.height);
        header.compression() = Imf::ZIP_COMPRESSION;
        for (const auto& [key, value] : exr.attributes)
            header.insert(key, Imf::StringAttribute(value));
        for (const std::string& name : exr.channels)
            header.channels().insert(
                name, Imf::Channel(samples == ExrSamples::half ? Imf::HALF : Imf::FLOAT));
        Imf::OutputFile file(stream, header);
        if (samples == ExrSamples::half) {
            std::vector<half> halves = to_halves(image, base_name(path));
            file.setFrameBuffer(frame_of(halves, image.width, exr.channels, {0, 0}));
            file.writePixels(image.height);
        } else {
            auto& pixels = const_cast<std::vector<float>&>(image.pixels); // it reads
            file.setFrameBuffer(frame_of(pixels, image.width, exr.channels, {0, 0}));
            file.writePixels(image.height);
        }
    } catch (const Error&) {
        throw;
    } catch (const std::exception& e) {
        throw Error(Fault::bad_argument, base_name(path) + ": OpenEXR refuses: " + e.what());
    }
    write_file(path, stream.bytes);
}

std::string flat_exr(std::string_view bytes, const std::string& where,
                     const std::vector<std::string>& channels) {
    HeaderWalk(bytes, where).check();
    StringInput stream(bytes);
    Imf::InputFile file(stream);
    const Imf::Header& header = file.header();
    if (header.compression() == Imf::DWAA_COMPRESSION ||
        header.compression() == Imf::DWAB_COMPRESSION)
        throw Error(Fault::unsupported, where + ": DWA compression is lossy; save it with ZIP");
    const std::vector<std::string> names = chosen(header.channels(), channels, where);
    Image image = empty_image(header, names.size(), bytes.size(), where);
    const Imath::Box2i window = header.dataWindow();
    file.setFrameBuffer(frame_of(image.pixels, image.width, names, window.min));
    file.readPixels(window.min.y, window.max.y);
    FlatWriter out;
    out.put<std::int32_t>(image.width);
    out.put<std::int32_t>(image.height);
    out.put<std::uint32_t>(static_cast<std::uint32_t>(names.size()));
    for (const std::string& name : names)
        out.put_text(name);
    std::vector<std::pair<std::string, std::string>> texts;
    for (auto it = header.begin(); it != header.end(); ++it)
        if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&it.attribute()))
            texts.emplace_back(it.name(), text->value());
    out.put<std::uint32_t>(static_cast<std::uint32_t>(texts.size()));
    for (const auto& [key, text] : texts) {
        out.put_text(key);
        out.put_text(text);
    }
    out.put_all(std::span<const float>(image.pixels));
    return std::move(out.bytes);
}

ExrImage read_exr(const std::filesystem::path& path, std::span<const std::string> channels) {
    const std::string name = base_name(path);
    const std::string flat =
        read_foreign("exr", read_file(path), name, {channels.begin(), channels.end()});
    FlatReader in(flat, name);
    const auto width = in.get<std::int32_t>(), height = in.get<std::int32_t>();
    const auto n_channels = in.get<std::uint32_t>();
    ExrImage out;
    for (std::uint32_t c = 0; c < n_channels; ++c)
        out.channels.push_back(in.get_text());
    const auto n_texts = in.get<std::uint32_t>();
    for (std::uint32_t i = 0; i < n_texts; ++i) {
        const std::string key = in.get_text();
        out.attributes.emplace_back(key, in.get_text());
    }
    std::vector<float> pixels = in.get_all<std::vector<float>>();
    in.expect_end();
    const std::uint64_t n = std::uint64_t(std::max(width, 0)) * std::uint64_t(std::max(height, 0));
    if (n == 0 || n_channels < 1 || pixels.size() % n != 0 || pixels.size() / n != n_channels)
        in.fail("is no picture");
    out.image.width = width;
    out.image.height = height;
    out.image.channels = static_cast<int>(n_channels);
    out.image.pixels = std::move(pixels);
    return out;
}

} // namespace taihu
