<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE TS>
<TS version="2.1" language="de" sourcelanguage="en">
  <context>
    <name>cad_implicit</name>
    <message>
      <source>bound {}</source>
      <translation>Schranke {}</translation>
    </message>
    <message>
      <source>Validate</source>
      <translation>Prüfen</translation>
    </message>
    <message>
      <source>Measure the error of a fillet against the exact kernel, and open the report</source>
      <translation>Den Fehler einer Verrundung am exakten Kern messen und den Bericht öffnen</translation>
    </message>
    <message>
      <source>Convert to Solid</source>
      <translation>In Volumenkörper umwandeln</translation>
    </message>
    <message>
      <source>Make a solid of a closed mesh, with triangles in one plane merged</source>
      <translation>Aus einem geschlossenen Netz einen Volumenkörper machen; Dreiecke einer Ebene werden vereint</translation>
    </message>
    <message>
      <source>Export</source>
      <translation>Exportieren</translation>
    </message>
    <message>
      <source>Write the selected part as STL, 3MF or STEP</source>
      <translation>Das gewählte Teil als STL, 3MF oder STEP schreiben</translation>
    </message>
    <message>
      <source>{} failed</source>
      <translation>{} ist fehlgeschlagen</translation>
    </message>
    <message>
      <source>All edges. Click edges in the 3-D view to work on those only.</source>
      <translation>Alle Kanten. Kanten in der 3D-Ansicht anklicken, um nur diese zu bearbeiten.</translation>
    </message>
    <message>
      <source>Remove</source>
      <translation>Entfernen</translation>
    </message>
    <message>
      <source>Click faces in the 3-D view that are left open, and again to close them.</source>
      <translation>Flächen, die offen bleiben, in der 3D-Ansicht anklicken; noch einmal, um sie zu schließen.</translation>
    </message>
    <message>
      <source>Click edges in the 3-D view to add them, and again to remove them.</source>
      <translation>Kanten in der 3D-Ansicht anklicken, um sie hinzuzufügen; noch einmal, um sie zu entfernen.</translation>
    </message>
    <message>
      <source>Radius of this edge; 0: the one for all.</source>
      <translation>Radius dieser Kante; 0: der für alle.</translation>
    </message>
    <message>
      <source>Edge</source>
      <translation>Kante</translation>
    </message>
    <message>
      <source>Face</source>
      <translation>Fläche</translation>
    </message>
    <message>
      <source>Own radius</source>
      <translation>Eigener Radius</translation>
    </message>
    <message>
      <source>self-checked error</source>
      <translation>selbst geprüfter Fehler</translation>
    </message>
    <message>
      <source>the error of this result is not known</source>
      <translation>der Fehler dieses Ergebnisses ist nicht bekannt</translation>
    </message>
    <message>
      <source>The error of {} could not be measured</source>
      <translation>Der Fehler von {} konnte nicht gemessen werden</translation>
    </message>
    <message>
      <source>The solid will have up to {} faces: {}, and {} as a STEP file. Go on?</source>
      <translation>Der Volumenkörper wird bis zu {} Flächen haben: {}, und {} als STEP-Datei. Fortfahren?</translation>
    </message>
    <message>
      <source>{} written</source>
      <translation>{} geschrieben</translation>
    </message>
    <message>
      <source>Grid: {spacing:.3g} mm, {cells} cells
Memory: {memory}
Time: {seconds}</source>
      <translation>Gitter: {spacing:.3g} mm, {cells} Zellen
Speicher: {memory}
Zeit: {seconds}</translation>
    </message>
    <message>
      <source>Preview</source>
      <translation>Vorschau</translation>
    </message>
    <message>
      <source>A coarse result, computed after every change</source>
      <translation>Ein grobes Ergebnis, nach jeder Änderung berechnet</translation>
    </message>
    <message>
      <source>Stop computing</source>
      <translation>Berechnung anhalten</translation>
    </message>
    <message>
      <source>Accuracy</source>
      <translation>Genauigkeit</translation>
    </message>
    <message>
      <source>about {:.0f} s</source>
      <translation>etwa {:.0f} s</translation>
    </message>
    <message>
      <source>{:.1f} million</source>
      <translation>{:.1f} Millionen</translation>
    </message>
    <message>
      <source>about {:.0f} min</source>
      <translation>etwa {:.0f} min</translation>
    </message>
    <message>
      <source>Implicit</source>
      <translation>Implizit</translation>
    </message>
    <message>
      <source>Fillets, rounds, offsets, shells and infill that never fail, with a known error</source>
      <translation>Verrundungen, Versatz, Schalen und Füllungen, die nie scheitern, mit bekanntem Fehler</translation>
    </message>
    <message>
      <source>The workbench Implicit needs Python packages that this FreeCAD does not have:</source>
      <translation>Der Arbeitsbereich Implicit braucht Python-Pakete, die dieses FreeCAD nicht hat:</translation>
    </message>
    <message>
      <source>Paste this into a terminal, then start FreeCAD again:</source>
      <translation>In ein Terminal einfügen, dann FreeCAD neu starten:</translation>
    </message>
    <message>
      <source>Packages are missing</source>
      <translation>Pakete fehlen</translation>
    </message>
    <message>
      <source>Copy the command</source>
      <translation>Befehl kopieren</translation>
    </message>
    <message>
      <source>Fillet</source>
      <translation>Hohlkehle</translation>
    </message>
    <message>
      <source>Fill concave edges, or those that you choose, with a rolling ball's surface</source>
      <translation>Hohle oder gewählte Kanten mit der Fläche einer rollenden Kugel füllen</translation>
    </message>
    <message>
      <source>Round</source>
      <translation>Abrunden</translation>
    </message>
    <message>
      <source>Round convex edges, or those that you choose</source>
      <translation>Vorstehende oder gewählte Kanten abrunden</translation>
    </message>
    <message>
      <source>Smooth</source>
      <translation>Glätten</translation>
    </message>
    <message>
      <source>Fillet and round: concave and convex edges</source>
      <translation>Hohle und vorstehende Kanten verrunden</translation>
    </message>
    <message>
      <source>Chamfer</source>
      <translation>Fase</translation>
    </message>
    <message>
      <source>Cut chosen edges off by a plane, or fill them</source>
      <translation>Gewählte Kanten eben abschneiden oder füllen</translation>
    </message>
    <message>
      <source>Offset</source>
      <translation>Versatz</translation>
    </message>
    <message>
      <source>Grow or shrink a part by a distance</source>
      <translation>Ein Teil um einen Abstand wachsen oder schrumpfen lassen</translation>
    </message>
    <message>
      <source>Shell</source>
      <translation>Schale</translation>
    </message>
    <message>
      <source>Hollow a part out, with faces left open</source>
      <translation>Ein Teil aushöhlen, mit offenen Flächen</translation>
    </message>
    <message>
      <source>Infill</source>
      <translation>Füllung</translation>
    </message>
    <message>
      <source>Fill a part with a lattice behind a skin</source>
      <translation>Ein Teil hinter einer Haut mit einem Gitter füllen</translation>
    </message>
    <message>
      <source>Boolean</source>
      <translation>Boolesch</translation>
    </message>
    <message>
      <source>Unite, cut or intersect two parts or meshes, with a fillet between them</source>
      <translation>Zwei Teile oder Netze vereinen, abziehen oder schneiden, mit Hohlkehle dazwischen</translation>
    </message>
    <message>
      <source>reports compare with the exact kernel, which does not take meshes</source>
      <translation>Berichte vergleichen mit dem exakten Kern, der keine Netze nimmt</translation>
    </message>
    <message>
      <source>reports are for one radius; this feature has edges with their own</source>
      <translation>Berichte gelten für einen Radius; hier haben Kanten eigene</translation>
    </message>
    <message>
      <source>Cancel</source>
      <translation>Abbrechen</translation>
    </message>
    <message>
      <source>There is no report</source>
      <translation>Es gibt keinen Bericht</translation>
    </message>
    <message>
      <source>Measuring the error of {} …</source>
      <translation>Der Fehler von {} wird gemessen …</translation>
    </message>
    <message>
      <source>the process ended without a word</source>
      <translation>der Prozess endete ohne ein Wort</translation>
    </message>
    <message>
      <source>Report: {}</source>
      <translation>Bericht: {}</translation>
    </message>
    <message>
      <source>Error in colours</source>
      <translation>Fehler in Farben</translation>
    </message>
    <message>
      <source>Result as a solid</source>
      <translation>Ergebnis als Volumenkörper</translation>
    </message>
    <message>
      <source>Result as a mesh</source>
      <translation>Ergebnis als Netz</translation>
    </message>
    <message>
      <source>Result of {}</source>
      <translation>Ergebnis von {}</translation>
    </message>
    <message>
      <source>Edit {}</source>
      <translation>{} bearbeiten</translation>
    </message>
    <message>
      <source>Computing …</source>
      <translation>Berechnen …</translation>
    </message>
    <message>
      <source>Radius</source>
      <translation>Radius</translation>
    </message>
    <message>
      <source>Length</source>
      <translation>Länge</translation>
    </message>
    <message>
      <source>Second length</source>
      <translation>Zweite Länge</translation>
    </message>
    <message>
      <source>Distance</source>
      <translation>Abstand</translation>
    </message>
    <message>
      <source>Thickness</source>
      <translation>Wandstärke</translation>
    </message>
    <message>
      <source>Wall lies</source>
      <translation>Wand liegt</translation>
    </message>
    <message>
      <source>Walls of the lattice</source>
      <translation>Wände des Gitters</translation>
    </message>
    <message>
      <source>Cell size</source>
      <translation>Zellgröße</translation>
    </message>
    <message>
      <source>Skin</source>
      <translation>Haut</translation>
    </message>
    <message>
      <source>Kind</source>
      <translation>Art</translation>
    </message>
    <message>
      <source>Follow smooth edges</source>
      <translation>Glatten Kanten folgen</translation>
    </message>
    <message>
      <source>FreeCAD's kernel first</source>
      <translation>Erst FreeCADs Kern</translation>
    </message>
    <message>
      <source>Engine</source>
      <translation>Verfahren</translation>
    </message>
    <message>
      <source>Tolerance</source>
      <translation>Toleranz</translation>
    </message>
    <message>
      <source>Grid spacing</source>
      <translation>Gitterabstand</translation>
    </message>
    <message>
      <source>Force</source>
      <translation>Erzwingen</translation>
    </message>
    <message>
      <source>exact distance</source>
      <translation>exakter Abstand</translation>
    </message>
    <message>
      <source>regular grid</source>
      <translation>regelmäßiges Gitter</translation>
    </message>
    <message>
      <source>inside</source>
      <translation>innen</translation>
    </message>
    <message>
      <source>outside</source>
      <translation>außen</translation>
    </message>
    <message>
      <source>on both sides</source>
      <translation>beidseits</translation>
    </message>
    <message>
      <source>union</source>
      <translation>Vereinigung</translation>
    </message>
    <message>
      <source>difference</source>
      <translation>Differenz</translation>
    </message>
    <message>
      <source>intersection</source>
      <translation>Schnitt</translation>
    </message>
    <message>
      <source>Waiting for another computation …</source>
      <translation>Eine andere Berechnung läuft noch …</translation>
    </message>
    <message>
      <source>Starting the computing process …</source>
      <translation>Der Rechenprozess startet …</translation>
    </message>
    <message>
      <source>First use: compiling for this computer (once) …</source>
      <translation>Erster Gebrauch: Übersetzen für diesen Rechner (einmalig) …</translation>
    </message>
    <message>
      <source>Reading the part …</source>
      <translation>Das Teil wird gelesen …</translation>
    </message>
    <message>
      <source>Meshing …</source>
      <translation>Vernetzen …</translation>
    </message>
    <message>
      <source>Building the surface …</source>
      <translation>Die Oberfläche entsteht …</translation>
    </message>
    <message>
      <source>Checking …</source>
      <translation>Prüfen …</translation>
    </message>
    <message>
      <source>Building the solid …</source>
      <translation>Der Volumenkörper entsteht …</translation>
    </message>
    <message>
      <source>The source, and its edges or faces</source>
      <translation>Das Ausgangsteil und seine Kanten oder Flächen</translation>
    </message>
    <message>
      <source>How distances are computed: exactly, or on a regular grid; chosen edges always exactly</source>
      <translation>Wie Abstände berechnet werden: exakt oder auf regelmäßigem Gitter; gewählte Kanten immer exakt</translation>
    </message>
    <message>
      <source>Ask FreeCAD's own kernel first, and take its result if it is sound</source>
      <translation>Erst FreeCADs eigenen Kern fragen und sein Ergebnis nehmen, wenn es gesund ist</translation>
    </message>
    <message>
      <source>Go past refusals, as where most of the part would be lost</source>
      <translation>Über Ablehnungen hinweggehen, etwa wenn fast alles verloren ginge</translation>
    </message>
    <message>
      <source>Go on along edges that continue the chosen ones smoothly</source>
      <translation>An Kanten weitergehen, die gewählte glatt fortsetzen</translation>
    </message>
    <message>
      <source>What it gives</source>
      <translation>Was herauskommt</translation>
    </message>
    <message>
      <source>Largest accepted error; 0: automatic</source>
      <translation>Größter zugelassener Fehler; 0: selbsttätig</translation>
    </message>
    <message>
      <source>Spacing of the grid; 0: automatic</source>
      <translation>Abstand des Gitters; 0: selbsttätig</translation>
    </message>
    <message>
      <source>Largest expected error; -1: not known</source>
      <translation>Größter erwarteter Fehler; -1: unbekannt</translation>
    </message>
    <message>
      <source>Share of the area on exact surfaces, from 0 to 1</source>
      <translation>Anteil der Fläche auf exakten Flächen, 0 bis 1</translation>
    </message>
    <message>
      <source>Who made it</source>
      <translation>Wer es gemacht hat</translation>
    </message>
    <message>
      <source>What it took</source>
      <translation>Was es brauchte</translation>
    </message>
    <message>
      <source>What may differ from what you expect</source>
      <translation>Was anders sein kann als erwartet</translation>
    </message>
    <message>
      <source>Whether something changed since it was computed</source>
      <translation>Ob sich seit der Berechnung etwas änderte</translation>
    </message>
    <message>
      <source>Version of these properties</source>
      <translation>Fassung dieser Eigenschaften</translation>
    </message>
    <message>
      <source>Of what the result was computed from</source>
      <translation>Woraus das Ergebnis berechnet wurde</translation>
    </message>
    <message>
      <source>Radius of each chosen edge; 0: Radius</source>
      <translation>Radius jeder gewählten Kante; 0: Radius</translation>
    </message>
    <message>
      <source>Where chosen edges and faces are</source>
      <translation>Wo gewählte Kanten und Flächen sind</translation>
    </message>
    <message>
      <source>Length on the face on the left of an edge, seen from outside</source>
      <translation>Länge auf der Fläche links der Kante, von außen gesehen</translation>
    </message>
    <message>
      <source>Length on the face on its right; 0: the same</source>
      <translation>Länge auf der Fläche rechts; 0: dieselbe</translation>
    </message>
    <message>
      <source>Positive grows, negative shrinks</source>
      <translation>Positiv wächst, negativ schrumpft</translation>
    </message>
    <message>
      <source>Thickness of the wall</source>
      <translation>Stärke der Wand</translation>
    </message>
    <message>
      <source>Where the wall is</source>
      <translation>Wo die Wand liegt</translation>
    </message>
    <message>
      <source>Thickness of the lattice's walls or struts</source>
      <translation>Stärke der Wände oder Stäbe des Gitters</translation>
    </message>
    <message>
      <source>Period of the lattice</source>
      <translation>Periode des Gitters</translation>
    </message>
    <message>
      <source>The lattice</source>
      <translation>Das Gitter</translation>
    </message>
    <message>
      <source>Thickness of the skin; 0: none</source>
      <translation>Stärke der Haut; 0: keine</translation>
    </message>
    <message>
      <source>Radius of fillets along the joint; 0: sharp</source>
      <translation>Radius der Hohlkehlen entlang der Fuge; 0: scharf</translation>
    </message>
    <message>
      <source>What is done</source>
      <translation>Was geschieht</translation>
    </message>
    <message>
      <source>The second object</source>
      <translation>Das zweite Objekt</translation>
    </message>
    <message>
      <source>New features</source>
      <translation>Neue Formelemente</translation>
    </message>
    <message>
      <source>Tolerance (0: automatic)</source>
      <translation>Toleranz (0: selbsttätig)</translation>
    </message>
    <message>
      <source>Largest distance between a result and the true surface. 0 lets the grid follow from the radius.</source>
      <translation>Größter Abstand zwischen Ergebnis und wahrer Fläche. 0: das Gitter folgt aus dem Radius.</translation>
    </message>
    <message>
      <source> mm</source>
      <translation> mm</translation>
    </message>
    <message>
      <source>Exact: distances to the part itself. Re-initialization: the scheme of the paper on a regular grid.</source>
      <translation>Exakt: Abstände zum Teil selbst. Re-Initialisierung: das Verfahren des Aufsatzes auf regelmäßigem Gitter.</translation>
    </message>
    <message>
      <source>Exact</source>
      <translation>Exakt</translation>
    </message>
    <message>
      <source>Re-initialization</source>
      <translation>Re-Initialisierung</translation>
    </message>
    <message>
      <source>Preview while values are changed</source>
      <translation>Vorschau, während Werte geändert werden</translation>
    </message>
    <message>
      <source>This computer</source>
      <translation>Dieser Rechner</translation>
    </message>
    <message>
      <source>Threads (0: all cores)</source>
      <translation>Threads (0: alle Kerne)</translation>
    </message>
    <message>
      <source>Memory (0: most of what is free)</source>
      <translation>Speicher (0: das meiste des freien)</translation>
    </message>
    <message>
      <source>What one operation may take. Finer grids than fit are refused before anything is computed.</source>
      <translation>Was ein Vorgang nehmen darf. Feinere Gitter werden abgelehnt, bevor gerechnet wird.</translation>
    </message>
    <message>
      <source> GiB</source>
      <translation> GiB</translation>
    </message>
  </context>
</TS>
