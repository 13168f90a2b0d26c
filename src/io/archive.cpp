#include "io/archive.h"

#include <zip.h>

#include <algorithm>
#include <utility>

#include "rayrep/base/error.h"

namespace rayrep::detail {
namespace {

// Limits that no honest file comes near and that keep a zip bomb from filling the memory.
constexpr std::size_t kMaxPartBytes = std::size_t{512} << 20;
constexpr std::size_t kMaxExpansion = 200;  // bytes out per byte in, where more than kFreeExpansionBytes come out
constexpr std::size_t kFreeExpansionBytes = std::size_t{16} << 20;

struct ZipError {
  ZipError() { zip_error_init(&error); }
  ~ZipError() { zip_error_fini(&error); }
  ZipError(const ZipError&) = delete;
  ZipError& operator=(const ZipError&) = delete;
  std::string text() { return zip_error_strerror(&error); }
  zip_error_t error;
};

}  // namespace

Archive::Archive(const FileBytes& file, std::string kind) : file_(file), kind_(std::move(kind)), archive_(nullptr, zip_discard) {
  ZipError error;
  zip_source_t* source = zip_source_buffer_create(file.bytes.data(), file.bytes.size(), 0, &error.error);
  if (source != nullptr) {
    archive_.reset(zip_open_from_source(source, ZIP_RDONLY, &error.error));
    if (!archive_) zip_source_free(source);
  }
  if (!archive_)
    fail_read(file, "",
              concat(kind_ == "3MF" ? "a " : "an ", kind_, " file is a zip archive, and this one cannot be opened (", error.text(),
                     "). It is cut off or damaged; export or download it again."));
}

std::vector<std::string> Archive::names() const {
  std::vector<std::string> all;
  const zip_int64_t count = zip_get_num_entries(archive_.get(), 0);
  for (zip_int64_t n = 0; n < count; ++n)
    if (const char* name = zip_get_name(archive_.get(), static_cast<zip_uint64_t>(n), 0)) all.emplace_back(name);
  return all;
}

std::string Archive::read(const std::string& part, std::size_t most) const {
  const zip_int64_t index = locate(part);
  if (index < 0) fail_read(file_, "", concat("the ", kind_, " archive has no part '", part, "'. Export it again."));
  zip_stat_t stat;
  zip_stat_init(&stat);
  zip_stat_index(archive_.get(), static_cast<zip_uint64_t>(index), 0, &stat);
  const std::size_t packed = (stat.valid & ZIP_STAT_COMP_SIZE) != 0 ? stat.comp_size : file_.bytes.size();
  const std::size_t limit = std::min(kMaxPartBytes, std::max(kFreeExpansionBytes, kMaxExpansion * std::min(packed, kMaxPartBytes)));
  std::unique_ptr<zip_file_t, int (*)(zip_file_t*)> in(zip_fopen_index(archive_.get(), static_cast<zip_uint64_t>(index), 0),
                                                       zip_fclose);
  if (!in) fail_damaged(part, zip_strerror(archive_.get()));
  std::string bytes;
  std::vector<char> chunk(1 << 16);
  while (true) {
    const zip_int64_t got = zip_fread(in.get(), chunk.data(), chunk.size());
    if (got < 0) fail_damaged(part, zip_file_strerror(in.get()));
    if (got == 0) return bytes;
    bytes.append(chunk.data(), static_cast<std::size_t>(got));
    if (bytes.size() > most) return bytes;
    if (bytes.size() > limit)
      fail_read(file_, concat("part '", part, "'"),
                concat("it unpacks to more than ", limit >> 20, " MiB from ", packed, " bytes, which is more than rayrep accepts. ",
                       kind_ == "3MF" ? "Reduce the number of triangles, or save the model as STL." : "Is the file damaged?"));
  }
}

long long Archive::locate(const std::string& part) const { return zip_name_locate(archive_.get(), part.c_str(), ZIP_FL_NOCASE); }

void Archive::fail_damaged(const std::string& part, const char* reason) const {
  fail_read(file_, concat("part '", part, "'"),
            concat("it cannot be unpacked (", reason, "). The file is damaged or encrypted; export or download it again."));
}

std::string pack(const std::vector<ArchivePart>& parts) {
  ZipError error;
  const auto fail = [](const std::string& reason) {
    throw Error(ErrorCode::write, "Cannot pack the 3MF archive: " + reason + ".");
  };
  // The archive grows in memory; `packed` outlives it because of the extra reference.
  std::unique_ptr<zip_source_t, void (*)(zip_source_t*)> packed(zip_source_buffer_create(nullptr, 0, 0, &error.error),
                                                                zip_source_free);
  if (!packed) fail(error.text());
  zip_source_keep(packed.get());
  std::unique_ptr<zip_t, void (*)(zip_t*)> archive(zip_open_from_source(packed.get(), ZIP_CREATE | ZIP_TRUNCATE, &error.error),
                                                   zip_discard);
  if (!archive) {
    zip_source_free(packed.get());
    fail(error.text());
  }
  for (const auto& part : parts) {
    zip_source_t* source = zip_source_buffer(archive.get(), part.text.data(), part.text.size(), 0);
    const zip_int64_t index = source == nullptr ? -1 : zip_file_add(archive.get(), part.name, source, ZIP_FL_ENC_UTF_8);
    if (index < 0) {
      if (source != nullptr) zip_source_free(source);
      fail(zip_strerror(archive.get()));
    }
    // zlib's usual level: libzip's default of 9 takes 18 s instead of 4 for two million triangles, to save 6 % of the size.
    constexpr zip_uint32_t kLevel = 6;
    // 1980-01-01 00:00, the first moment a zip file can name: the same mesh gives the same bytes at any time.
    constexpr zip_uint16_t kDosDate = (1 << 5) | 1;
    const auto entry = static_cast<zip_uint64_t>(index);
    if (zip_set_file_compression(archive.get(), entry, ZIP_CM_DEFLATE, kLevel) != 0 ||
        zip_file_set_dostime(archive.get(), entry, 0, kDosDate, 0) != 0)
      fail(zip_strerror(archive.get()));
  }
  if (zip_close(archive.get()) != 0) fail(zip_strerror(archive.get()));
  static_cast<void>(archive.release());

  zip_stat_t stat;
  zip_stat_init(&stat);
  if (zip_source_stat(packed.get(), &stat) != 0 || zip_source_open(packed.get()) != 0)
    fail(zip_error_strerror(zip_source_error(packed.get())));
  std::string bytes(stat.size, '\0');
  const zip_int64_t got = zip_source_read(packed.get(), bytes.data(), bytes.size());
  zip_source_close(packed.get());
  if (got != static_cast<zip_int64_t>(bytes.size())) fail("its bytes could not be read back");
  return bytes;
}

}  // namespace rayrep::detail
