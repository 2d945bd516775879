#include "loop/scene/scene.h"

#include <fmt/format.h>

#include "loop/scene/scene_schema.h"
#include "loop/scene/text.h"
#include "loop/scene/toml_reader.h"

namespace mantle::scene {
namespace {

/// A scene's document and the files it was made of.
struct Source {
  TomlValue document;
  std::vector<std::filesystem::path> files;
};

// The document with what it `extends` merged under it.
Source Extended(TomlValue document, const std::string& name, const std::filesystem::path& directory,
                int depth) {
  constexpr int kMaxDepth = 8;
  const TomlValue* base = document.Find("extends");
  if (base == nullptr || base->kind != TomlValue::Kind::kText) return {std::move(document), {}};
  if (depth == kMaxDepth) {
    throw BadScene(fmt::format("{}: extends: \"{}\": more than {} files deep, or in a circle", name,
                               Printable(base->text), kMaxDepth));
  }
  const std::filesystem::path file = directory / base->text;
  const std::string base_name = Printable(file.filename().string());
  Source merged =
      Extended(ParseToml(ReadTextFile(file), base_name), base_name, file.parent_path(), depth + 1);
  merged.files.push_back(file);
  document.Remove("extends");
  MergeToml(document, &merged.document);
  return merged;
}

// Puts the overrides on the scene's own document: `extends` first, as the others may enter what it
// brings.
Source WithOverrides(TomlValue document, const std::string& name,
                     const std::filesystem::path& directory,
                     const std::vector<std::string>& overrides) {
  const auto chooses_base = [](const std::string& text) { return text.starts_with("extends="); };
  for (const std::string& text : overrides) {
    if (chooses_base(text)) ApplyOverride(text, &document);
  }
  Source source = Extended(std::move(document), name, directory, 0);
  for (const std::string& text : overrides) {
    if (!chooses_base(text)) ApplyOverride(text, &source.document);
  }
  return source;
}

}  // namespace

Scene ParseScene(std::string_view toml, const std::string& name,
                 const std::filesystem::path& directory,
                 const std::vector<std::string>& overrides) {
  const std::string shown = Printable(name);
  const Source source = WithOverrides(ParseToml(toml, shown), shown, directory, overrides);
  SceneContext context{shown, directory, &source.document, source.files};
  Scene scene;
  scene.name = NameFrom(std::filesystem::path(name).stem().string());
  TomlValue filled;
  TomlReader reader(source.document, "", &context, &filled);
  Describe(reader, scene);
  reader.Finish();
  scene.run.statics = scene.statics;  // of a run that starts from its equilibrium
  scene.text = WriteToml(filled);
  scene.fingerprint = Hash(scene.text, context.files_hash);
  scene.files = std::move(context.files);
  return scene;
}

Scene LoadScene(const std::filesystem::path& file, const std::vector<std::string>& overrides) {
  return ParseScene(ReadTextFile(file), file.filename().string(), file.parent_path(), overrides);
}

}  // namespace mantle::scene
