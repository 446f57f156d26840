#include <bzlib.h>
#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <memory>

#include "bag/recording.h"

namespace arex::sim {
namespace {

// A chunk holds one message more than its threshold of a few MB; nobody's message is so large.
constexpr std::uint64_t kMostUnpacked = std::uint64_t{1} << 30;
// Memory is taken as bytes come, not as a header promises.
constexpr std::size_t kStep = std::size_t{1} << 20;

/// Room for more in `out`, of which `used` bytes are taken. @throws DecodeError past `size`.
std::size_t make_room(std::string& out, std::size_t used, std::uint64_t size) {
  if (used == out.size()) {
    if (used > size) throw DecodeError("a chunk with more bytes than it says");
    // One byte beyond the promised size shows whether there are more.
    out.resize(std::min<std::uint64_t>(size + 1, std::max(kStep, 2 * used)));
  }
  return out.size() - used;
}

void unpack_bz2(std::string_view bytes, std::uint64_t size, std::string& out, std::size_t& used) {
  bz_stream stream{};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) throw DecodeError("no memory for bz2");
  const std::unique_ptr<bz_stream, int (*)(bz_stream*)> end(&stream, BZ2_bzDecompressEnd);
  stream.next_in = const_cast<char*>(bytes.data());  // of a C interface; it is not written to
  stream.avail_in = static_cast<unsigned>(bytes.size());
  for (int status = BZ_OK; status != BZ_STREAM_END;) {
    const std::size_t room = make_room(out, used, size);
    stream.next_out = out.data() + used;
    stream.avail_out = static_cast<unsigned>(room);
    status = BZ2_bzDecompress(&stream);
    used += room - stream.avail_out;
    const bool starved = stream.avail_in == 0 && stream.avail_out > 0 && status == BZ_OK;
    if ((status != BZ_OK && status != BZ_STREAM_END) || starved) {
      throw DecodeError("a damaged bz2 chunk");
    }
  }
}

void unpack_lz4(std::string_view bytes, std::uint64_t size, std::string& out, std::size_t& used) {
  LZ4F_dctx* made = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&made, LZ4F_VERSION))) {
    throw DecodeError("no memory for lz4");
  }
  const std::unique_ptr<LZ4F_dctx, LZ4F_errorCode_t (*)(LZ4F_dctx*)> context(
      made, LZ4F_freeDecompressionContext);
  for (std::size_t more = 1; more != 0;) {
    std::size_t room = make_room(out, used, size);
    std::size_t taken = bytes.size();
    more = LZ4F_decompress(context.get(), out.data() + used, &room, bytes.data(), &taken, nullptr);
    used += room;
    bytes.remove_prefix(taken);
    const bool starved = more != 0 && taken == 0 && room == 0;
    if (LZ4F_isError(more) || starved) throw DecodeError("a damaged lz4 chunk");
  }
}

void unpack_zstd(std::string_view bytes, std::uint64_t size, std::string& out, std::size_t& used) {
  const std::unique_ptr<ZSTD_DCtx, std::size_t (*)(ZSTD_DCtx*)> context(ZSTD_createDCtx(),
                                                                        ZSTD_freeDCtx);
  if (!context) throw DecodeError("no memory for zstd");
  ZSTD_inBuffer in{bytes.data(), bytes.size(), 0};
  for (std::size_t more = 1; more != 0;) {
    const std::size_t room = make_room(out, used, size);
    const std::size_t before = in.pos;
    ZSTD_outBuffer written{out.data() + used, room, 0};
    more = ZSTD_decompressStream(context.get(), &written, &in);
    used += written.pos;
    const bool starved = more != 0 && in.pos == before && written.pos == 0;
    if (ZSTD_isError(more) || starved) throw DecodeError("a damaged zstd chunk");
  }
}

}  // namespace

std::string unpack(std::string_view bytes, ChunkCompression compression, std::uint64_t size) {
  if (size > kMostUnpacked || bytes.size() > kMostUnpacked) {
    throw DecodeError("a chunk of more than 1 GiB");
  }
  std::string out;
  std::size_t used = 0;
  switch (compression) {
    case ChunkCompression::kNone:
      out = bytes;
      used = bytes.size();
      break;
    case ChunkCompression::kBz2:
      unpack_bz2(bytes, size, out, used);
      break;
    case ChunkCompression::kLz4:
      unpack_lz4(bytes, size, out, used);
      break;
    case ChunkCompression::kZstd:
      unpack_zstd(bytes, size, out, used);
      break;
  }
  if (used != size) throw DecodeError("a chunk of another size than it says");
  out.resize(used);
  return out;
}

}  // namespace arex::sim
