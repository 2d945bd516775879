/// The page: reads its data, and shows the runs that it holds, or those that come from the server it came from.

import "./style.css";
import { element } from "./dom";
import { LivePage } from "./live_page";
import { type PackedRun, type ReportData, type Run, decodeRun, kFormat } from "./model";
import { Report } from "./report";

function readData(): ReportData {
  const text = document.getElementById("mantle-data")?.textContent ?? "";
  const data = JSON.parse(text) as ReportData;
  if (data.format !== kFormat) {
    throw new Error(`the data is of format ${data.format}, this page reads format ${kFormat}: make the report anew`);
  }
  return data;
}

function decode(packed: PackedRun): Run {
  try {
    return decodeRun(packed);
  } catch (error) {
    throw new Error(`${packed.label}: ${(error as Error).message}`);
  }
}

const app = document.getElementById("app")!;
try {
  const data = readData();
  if (data.live !== undefined) {
    new LivePage(app, data.live.url, data.made_by);
  } else {
    if (data.runs.length === 0) throw new Error("it holds no runs");
    const report = new Report(app, { runs: data.runs.map(decode), madeBy: data.made_by, live: false });
    // `mantle export --format mp4` asks for its pictures by this (tools/report/page_camera.cc).
    Object.assign(window, { mantleFilm: { begin: () => report.beginFilm(), show: (time: number) => report.showFilm(time) } });
  }
} catch (error) {
  console.error(error);
  app.append(element("p", { class: "empty", role: "alert" }, [`This report cannot be shown: ${(error as Error).message}.`]));
}
