// SPDX-License-Identifier: Apache-2.0
// The words of the robot's own screen in each language. Another language is another entry.
export const kLanguages = ["en", "de"] as const;
export type Language = (typeof kLanguages)[number];

const kEnglish = {
  language: "English",
  hello: "Hello! What can I do?",
  yes: "Yes",
  no: "No",
  left: "Left",
  ahead: "Straight on",
  right: "Right",
  say: "Say",
  type: "Type here",
  explore: "Look around",
  halt: "Stop here",
  way: "Which way?",
  answer: "Your answer",
  status: "I am doing",
  heard: "I heard",
  not_heard: "That did not arrive",
  nobody: "This graph has no device for a dialogue.",
  locked: "Answers are off",
  back: "Back",
  full: "Full screen",
};

export type Words = typeof kEnglish;

const kGerman: Words = {
  language: "Deutsch",
  hello: "Hallo! Was kann ich tun?",
  yes: "Ja",
  no: "Nein",
  left: "Links",
  ahead: "Geradeaus",
  right: "Rechts",
  say: "Sagen",
  type: "Hier tippen",
  explore: "Sieh dich um",
  halt: "Bleib stehen",
  way: "Welche Richtung?",
  answer: "Ihre Antwort",
  status: "Ich mache gerade",
  heard: "Verstanden",
  not_heard: "Das kam nicht an",
  nobody: "Dieser Graph hat kein Gerät für ein Gespräch.",
  locked: "Antworten sind aus",
  back: "Zurück",
  full: "Vollbild",
};

export const kWords: Record<Language, Words> = { en: kEnglish, de: kGerman };

export function preferred_language(): Language {
  return navigator.language.toLowerCase().startsWith("de") ? "de" : "en";
}
