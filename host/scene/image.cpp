/* The C face of OpenImageIO: a few calls, no exception gets out. A module of its own; see codec.h. */
extern "C" {
#include "host/scene/codec.h"
}

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <cstdlib>
#include <cstring>
#include <exception>
#include <string>

namespace {

/* The first line of OpenImageIO's pending message. */
std::string message() {
    std::string text = OIIO::geterror();
    return text.substr(0, text.find('\n'));
}

qp_status encode(const char *path, const qp_image *image, bool png, void **bytes, std::size_t *size,
                 qp_error *err) {
    auto output = OIIO::ImageOutput::create(png ? "png" : "openexr");
    if (!output) return qp_fail(err, QP_SYSTEM, "%s: %s", path, message().c_str());
    OIIO::TypeDesc type = png ? OIIO::TypeDesc::UINT8 : OIIO::TypeDesc::FLOAT;
    OIIO::ImageSpec spec(static_cast<int>(image->width), static_cast<int>(image->height), 4, type);
    if (png)
        spec.attribute("oiio:UnassociatedAlpha", 1);
    else
        spec.attribute("compression", "zip");
    OIIO::Filesystem::IOVecOutput memory;
    const void *pixels = png ? static_cast<const void *>(image->rgba) : image->rgba_f;
    bool good = output->set_ioproxy(&memory) && output->open(png ? "x.png" : "x.exr", spec) &&
                output->write_image(type, pixels);
    good = output->close() && good;
    if (!good) {
        std::string text = output->geterror();
        return qp_fail(err, QP_SYSTEM, "%s: cannot be written: %s", path,
                       text.substr(0, text.find('\n')).c_str());
    }
    *size = memory.buffer().size();
    *bytes = qp_alloc(*size, 1, false);
    if (*bytes == nullptr) return qp_fail_memory(err, *size, "a picture file");
    std::memcpy(*bytes, memory.buffer().data(), *size);
    return QP_OK;
}

/* Spreads n channels in the first places of each pixel over four. */
template <typename T> void spread(T *pixels, std::size_t count, int n, T opaque) {
    for (std::size_t k = count; k-- > 0;) {
        T in[4];
        for (int c = 0; c < n; ++c)
            in[c] = pixels[k * static_cast<std::size_t>(n) + static_cast<std::size_t>(c)];
        T *out = pixels + 4 * k;
        bool grey = n < 3;
        out[0] = in[0];
        out[1] = grey ? in[0] : in[1];
        out[2] = grey ? in[0] : in[2];
        out[3] = n == 4 ? in[3] : n == 2 ? in[1] : opaque;
    }
}

qp_status read_from(const char *path, qp_image *image, bool png, qp_error *err) {
    OIIO::ImageSpec wish;
    wish.attribute("oiio:UnassociatedAlpha", png ? 1 : 0);
    auto input = OIIO::ImageInput::open(path, &wish);
    if (!input) return qp_fail(err, QP_BAD_INPUT, "%s: cannot be read: %s", path, message().c_str());
    const OIIO::ImageSpec &spec = input->spec();
    int n = spec.nchannels;
    if (n < 1 || n > 4 || spec.depth > 1)
        return qp_fail(err, QP_BAD_INPUT, "%s: %d channels, not one to four", path, n);
    if (spec.width < 1 || spec.height < 1) return qp_fail(err, QP_BAD_INPUT, "%s: an empty picture", path);
    qp_status status =
        qp_image_create(static_cast<uint32_t>(spec.width), static_cast<uint32_t>(spec.height), image, err);
    if (status != QP_OK) return status;
    std::size_t count = static_cast<std::size_t>(image->width) * image->height;
    OIIO::TypeDesc type = png ? OIIO::TypeDesc::UINT8 : OIIO::TypeDesc::FLOAT;
    if (!input->read_image(0, 0, 0, n, type, png ? static_cast<void *>(image->rgba) : image->rgba_f)) {
        std::string text = input->geterror();
        qp_image_free(image);
        return qp_fail(err, QP_BAD_INPUT, "%s: cannot be read: %s", path,
                       text.substr(0, text.find('\n')).c_str());
    }
    if (png) {
        spread<uint8_t>(image->rgba, count, n, 255);
        std::free(image->rgba_f);
        image->rgba_f = nullptr;
    } else {
        spread<float>(image->rgba_f, count, n, 1.0f);
        std::free(image->rgba);
        image->rgba = nullptr;
    }
    return QP_OK;
}

qp_status guarded_encode(const char *path, const qp_image *image, bool png, void **bytes, std::size_t *size,
                         qp_error *err) {
    try {
        return encode(path, image, png, bytes, size, err);
    } catch (const std::exception &e) {
        return qp_fail(err, QP_SYSTEM, "%s: cannot be written: %s", path, e.what());
    }
}

qp_status guarded_read(const char *path, qp_image *image, bool png, qp_error *err) {
    try {
        return read_from(path, image, png, err);
    } catch (const std::exception &e) {
        return qp_fail(err, QP_SYSTEM, "%s: cannot be read: %s", path, e.what());
    }
}

} // namespace

extern "C" QP_API const qp_image_codec qp_image_module;
extern "C" const qp_image_codec qp_image_module = {guarded_encode, guarded_read};
